//! Counters of one query. They explain where the time went; they depend on threads and are no output.

/// What a query did. Returned by value; sums with [`Stats::plus`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stats {
    /// Steps of the recursion.
    pub nodes: u64,
    /// Boxes tested against the frustum of a sub-pencil, or against the shaft of a bundle.
    pub frustum_tests: u64,
    /// Boxes tested against one ray.
    pub box_tests: u64,
    /// Boxes dropped because they lie outside the frustum.
    pub culled_by_bound: u64,
    /// Boxes dropped because every ray of the sub-pencil has hit something nearer.
    pub culled_by_depth: u64,
    /// Triangles prepared for a sub-pencil or a bundle, or tested in a leaf of the general path.
    pub triangles_set_up: u64,
    /// Parts of blocks of rays, up to 8x8, that a triangle was tested with.
    pub blocks: u64,
    /// Pairs of a ray and a triangle whose edge functions were evaluated: the unit in which local statistics tell the work
    /// ([`TileStats::samples_per_ray`], [`crate::query::frame::Frame::pairs`]). Bundles evaluate a group as eight triangles, whatever it holds; of
    /// surfaces on demand those pairs count that rounded edge functions leave.
    pub samples_tested: u64,
    /// Pairs whose coverage or order f32 could not decide on a grid film.
    pub doubtful_samples: u64,
    /// Pairs whose coverage f64 could not decide.
    pub ambiguous_coverage: u64,
    /// Edge functions of exactly zero: the ray passes through an edge or a corner, and a rule decides.
    pub edge_ties: u64,
    /// Pairs of hits whose order f64 could not decide.
    pub ambiguous_order: u64,
    /// Hits of which f64 could not decide whether they lie within the interval of their ray.
    pub ambiguous_limit: u64,
    /// Hits whose distance f64 could not round to the nearest f32. Where a triangle faces the film, one for all rays of a tile.
    pub ambiguous_distance: u64,
    /// Rays of samples by which the general path has chosen a partition.
    pub rays_sampled: u64,
    /// Steps of the general path that did not ask which rays meet a box, as a sample has said that most do.
    pub filters_skipped: u64,
    /// References to triangles that the voxels of a spatial partition have made.
    pub references_made: u64,
    /// Bytes of rays and objects touched by steps of the general path whose rays and objects are at most 32 KiB.
    pub bytes_within_32k: u64,
    /// Those touched by steps beyond that of at most 1 MiB.
    pub bytes_within_1m: u64,
    /// Those touched by larger steps.
    pub bytes_beyond_1m: u64,
    /// Groups of surfaces that were expanded.
    pub surfaces_expanded: u64,
    /// Patches, or parts of them, that were split.
    pub surfaces_split: u64,
    /// Groups, patches and parts dropped because they lie outside a frustum.
    pub surfaces_culled_by_frustum: u64,
    /// Those dropped because every ray that they may meet has hit something nearer.
    pub surfaces_culled_by_depth: u64,
    /// Parts of patches that were diced; those in several tiles count in each.
    pub surfaces_diced: u64,
    /// Micropolygons made: quadrilaterals of grids.
    pub micropolygons: u64,
    /// The most micropolygons that were kept at the same time.
    pub micropolygons_in_flight: u64,
    /// Peak bytes of the engine's own buffers: without triangles, rays and hits.
    pub engine_bytes: u64,
}

impl Stats {
    /// The sum of two parts of a query. Bytes add up, as both parts live at the same time.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let (mut sum, others) = (self, other.counters());
        for (counter, (_, count)) in sum.counters_mut().into_iter().zip(others) {
            *counter += count;
        }
        sum
    }

    /// The sum of a query and the one after it, whose buffers take the place of the first's: of bytes the larger remain.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self { engine_bytes: self.engine_bytes.max(next.engine_bytes), ..self.plus(next) }
    }

    /// All counters with their names, in a fixed order: for reports.
    #[must_use]
    pub fn counters(&self) -> [(&'static str, u64); 28] {
        [
            ("nodes", self.nodes),
            ("frustum_tests", self.frustum_tests),
            ("box_tests", self.box_tests),
            ("culled_by_bound", self.culled_by_bound),
            ("culled_by_depth", self.culled_by_depth),
            ("triangles_set_up", self.triangles_set_up),
            ("blocks", self.blocks),
            ("samples_tested", self.samples_tested),
            ("doubtful_samples", self.doubtful_samples),
            ("ambiguous_coverage", self.ambiguous_coverage),
            ("edge_ties", self.edge_ties),
            ("ambiguous_order", self.ambiguous_order),
            ("ambiguous_limit", self.ambiguous_limit),
            ("ambiguous_distance", self.ambiguous_distance),
            ("rays_sampled", self.rays_sampled),
            ("filters_skipped", self.filters_skipped),
            ("references_made", self.references_made),
            ("bytes_within_32k", self.bytes_within_32k),
            ("bytes_within_1m", self.bytes_within_1m),
            ("bytes_beyond_1m", self.bytes_beyond_1m),
            ("surfaces_expanded", self.surfaces_expanded),
            ("surfaces_split", self.surfaces_split),
            ("surfaces_culled_by_frustum", self.surfaces_culled_by_frustum),
            ("surfaces_culled_by_depth", self.surfaces_culled_by_depth),
            ("surfaces_diced", self.surfaces_diced),
            ("micropolygons", self.micropolygons),
            ("micropolygons_in_flight", self.micropolygons_in_flight),
            ("engine_bytes", self.engine_bytes),
        ]
    }

    /// Counts the bytes that a step of the general path touches.
    pub(crate) fn touch(&mut self, bytes: u64) {
        match bytes {
            0..=0x8000 => self.bytes_within_32k += bytes,
            0x8001..=0x10_0000 => self.bytes_within_1m += bytes,
            _ => self.bytes_beyond_1m += bytes,
        }
    }

    /// The counters in the order of [`Stats::counters`].
    fn counters_mut(&mut self) -> [&mut u64; 28] {
        [
            &mut self.nodes,
            &mut self.frustum_tests,
            &mut self.box_tests,
            &mut self.culled_by_bound,
            &mut self.culled_by_depth,
            &mut self.triangles_set_up,
            &mut self.blocks,
            &mut self.samples_tested,
            &mut self.doubtful_samples,
            &mut self.ambiguous_coverage,
            &mut self.edge_ties,
            &mut self.ambiguous_order,
            &mut self.ambiguous_limit,
            &mut self.ambiguous_distance,
            &mut self.rays_sampled,
            &mut self.filters_skipped,
            &mut self.references_made,
            &mut self.bytes_within_32k,
            &mut self.bytes_within_1m,
            &mut self.bytes_beyond_1m,
            &mut self.surfaces_expanded,
            &mut self.surfaces_split,
            &mut self.surfaces_culled_by_frustum,
            &mut self.surfaces_culled_by_depth,
            &mut self.surfaces_diced,
            &mut self.micropolygons,
            &mut self.micropolygons_in_flight,
            &mut self.engine_bytes,
        ]
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
        let sides = [self.columns, self.rows].map(|[first, end]| f64::from(end - first));
        self.stats.samples_tested as f64 / (sides[0] * sides[1])
    }
}
