//! All engines that this build has, and that the machine offers.

use serde_json::Value;

use crate::Result;
use crate::cli::Common;
use crate::engine::Engine;
use crate::machine;
use crate::subject::Subject;
use crate::umbel_engine::Umbel;

#[cfg(feature = "embree")]
type Device = std::sync::Arc<crate::embree::Device>;
/// Stands for a device where Embree is not compiled in.
#[cfg(not(feature = "embree"))]
type Device = std::convert::Infallible;

/// What engines share over all subjects.
#[derive(Debug)]
pub(crate) struct Engines {
    /// Embree, if its library was named.
    pub(crate) embree: Option<Device>,
}

impl Engines {
    /// Loads what has to be loaded, for the threads of the current pool.
    pub(crate) fn open(common: &Common) -> Result<Self> {
        let Some(path) = &common.embree else {
            eprintln!("note: no --embree and no EMBREE_LIBRARY, so Embree is left out");
            return Ok(Self { embree: None });
        };
        #[cfg(feature = "embree")]
        return Ok(Self { embree: Some(crate::embree::Device::new(path, rayon::current_num_threads())?) });
        #[cfg(not(feature = "embree"))]
        Err(format!("{}: this build has no feature embree", path.display()).into())
    }

    /// The versions of all engines.
    pub(crate) fn versions(&self) -> Value {
        #[cfg(feature = "embree")]
        return machine::versions(self.embree.as_ref().map(|device| device.version()));
        #[cfg(not(feature = "embree"))]
        machine::versions(None)
    }

    /// umbel first, then all others whose names are wanted.
    #[cfg_attr(
        not(any(feature = "embree", feature = "obvhs", feature = "parry")),
        expect(unused_mut, unused_variables, reason = "umbel is alone")
    )]
    pub(crate) fn prepare(
        &self,
        subject: &Subject,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine>>> {
        let mut engines: Vec<Box<dyn Engine>> =
            vec![Box::new(Umbel::from_scratch()), Box::new(Umbel::keeping_order())];
        #[cfg(feature = "embree")]
        if let Some(device) = &self.embree {
            engines.extend(crate::embree_engine::variants(device, subject, &wanted)?);
        }
        #[cfg(feature = "obvhs")]
        engines.extend(crate::obvhs_engine::variants(subject, &wanted));
        #[cfg(feature = "parry")]
        if wanted("parry3d") {
            engines.push(Box::new(crate::parry_engine::Parry));
        }
        Ok(engines)
    }
}
