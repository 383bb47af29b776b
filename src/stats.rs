//! Counters of one query. They explain where the time went; they depend on threads and are no output.

/// The counters, each written once: their fields, their names for reports, and their places for sums.
macro_rules! counters {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// What a query did. Returned by value; sums with [`Stats::plus`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct Stats {
            $($(#[$doc])* pub $name: u64,)*
        }

        /// Their number.
        const COUNTERS: usize = [$(stringify!($name)),*].len();

        impl Stats {
            /// All counters with their names, in a fixed order: for reports.
            #[must_use]
            pub fn counters(&self) -> [(&'static str, u64); COUNTERS] {
                [$((stringify!($name), self.$name)),*]
            }

            /// The counters in the order of [`Stats::counters`].
            fn counters_mut(&mut self) -> [&mut u64; COUNTERS] {
                [$(&mut self.$name),*]
            }
        }
    };
}

counters! {
    /// Steps of the recursion.
    nodes,
    /// Boxes tested against the frustum of a sub-pencil, or against the shaft of a bundle.
    frustum_tests,
    /// Boxes tested against one ray.
    box_tests,
    /// Boxes dropped because they lie outside the frustum.
    culled_by_bound,
    /// Boxes dropped because every ray of the sub-pencil has hit something nearer.
    culled_by_depth,
    /// Triangles prepared for a sub-pencil or a bundle, or tested in a leaf of the general path.
    triangles_set_up,
    /// Parts of blocks of rays, up to 8x8, that a triangle was tested with.
    blocks,
    /// Pairs of a ray and a triangle whose edge functions were evaluated: the unit in which local statistics tell the
    /// work ([`TileStats::samples_per_ray`], [`crate::query::frame::Frame::pairs`]). Bundles evaluate a leaf as eight
    /// triangles, whatever it holds; of surfaces on demand those pairs count that rounded edge functions leave.
    samples_tested,
    /// Pairs whose coverage or order f32 could not decide on a grid film.
    doubtful_samples,
    /// Pairs whose coverage f64 could not decide.
    ambiguous_coverage,
    /// Edge functions of exactly zero: the ray passes through an edge or a corner, and a rule decides.
    edge_ties,
    /// Pairs of hits whose order f64 could not decide.
    ambiguous_order,
    /// Hits of which f64 could not decide whether they lie within the interval of their ray.
    ambiguous_limit,
    /// Hits whose distance f64 could not round to the nearest f32. Where a triangle faces the film, one for all rays of a tile.
    ambiguous_distance,
    /// Rays of samples by which the general path has chosen a partition.
    rays_sampled,
    /// Steps of the general path that did not ask which rays meet a box, as a sample has said that most do.
    filters_skipped,
    /// References to triangles that the voxels of a spatial partition have made.
    references_made,
    /// Bytes of rays and objects touched by steps of the general path whose rays and objects are at most 32 KiB.
    bytes_within_32k,
    /// Those touched by steps beyond that of at most 1 MiB.
    bytes_within_1m,
    /// Those touched by larger steps.
    bytes_beyond_1m,
    /// Groups of surfaces that were expanded.
    surfaces_expanded,
    /// Patches, or parts of them, that were split.
    surfaces_split,
    /// Groups, patches and parts dropped because they lie outside a frustum.
    surfaces_culled_by_frustum,
    /// Those dropped because every ray that they may meet has hit something nearer.
    surfaces_culled_by_depth,
    /// Parts of patches that were diced; those in several tiles count in each.
    surfaces_diced,
    /// Micropolygons made: quadrilaterals of grids.
    micropolygons,
    /// The most micropolygons that were kept at the same time.
    micropolygons_in_flight,
    /// Peak bytes of the engine's own buffers: without triangles, rays and hits.
    engine_bytes,
}

impl Stats {
    /// Questions that filters left to more exact arithmetic, of all kinds: of f32 on films, of f64 elsewhere.
    #[must_use]
    pub fn doubts(&self) -> u64 {
        self.doubtful_samples
            + self.ambiguous_coverage
            + self.edge_ties
            + self.ambiguous_order
            + self.ambiguous_limit
            + self.ambiguous_distance
    }

    /// The sum of two parts of a query. Bytes add up, as both parts live at the same time.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let (mut sum, others) = (self, other.counters());
        for (counter, (_, count)) in sum.counters_mut().into_iter().zip(others) {
            *counter += count;
        }
        sum
    }

    /// The sum of a query and the one after it, whose buffers take the place of the first's: of bytes the larger
    /// remain.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self { engine_bytes: self.engine_bytes.max(next.engine_bytes), ..self.plus(next) }
    }

    /// Counts the bytes that a step of the general path touches.
    pub(crate) fn touch(&mut self, bytes: u64) {
        match bytes {
            0..=0x8000 => self.bytes_within_32k += bytes,
            0x8001..=0x10_0000 => self.bytes_within_1m += bytes,
            _ => self.bytes_beyond_1m += bytes,
        }
    }
}

/// What one tile of a film, or a whole scattered film, has cost: the local statistics of a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileStats {
    /// The film, in the order of the pencil.
    pub film: usize,
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// First row and the one after the last.
    pub rows: [u32; 2],
    /// Its counters.
    pub stats: Stats,
}

impl TileStats {
    /// Pairs of a ray and a triangle that were evaluated, per ray of the tile.
    #[must_use]
    pub fn samples_per_ray(&self) -> f64 {
        self.stats.samples_tested as f64 / self.rays()
    }

    /// [`Stats::doubts`], per ray of the tile.
    #[must_use]
    pub fn doubts_per_ray(&self) -> f64 {
        self.stats.doubts() as f64 / self.rays()
    }

    fn rays(&self) -> f64 {
        let [width, height] = [self.columns, self.rows].map(|[first, end]| f64::from(end - first));
        width * height
    }
}
