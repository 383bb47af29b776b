//! All engines that this build has, and that the machine offers.

#[cfg(feature = "embree")]
pub(crate) mod embree;
pub(crate) mod engine;
#[cfg(feature = "llvmpipe")]
mod llvmpipe;
#[cfg(feature = "obvhs")]
pub(crate) mod obvhs;
#[cfg(feature = "parry")]
mod parry;
pub(crate) mod rounds;
pub(crate) mod umbel;

use serde_json::Value;

use crate::Result;
use crate::commands::cli::Common;
use crate::engines::engine::{Engine, Variant};
use crate::engines::umbel::Umbel;
use crate::machine;
use crate::subjects::ambient::Ambient;
use crate::subjects::bounce::Bounce;
use crate::subjects::picture::Picture;
use crate::subjects::shadow::Shadow;

#[cfg(feature = "embree")]
type Device = std::sync::Arc<embree::device::Device>;
/// Stands for a device where Embree is not compiled in.
#[cfg(not(feature = "embree"))]
type Device = std::convert::Infallible;

#[cfg(feature = "llvmpipe")]
type Context = std::rc::Rc<llvmpipe::gl_context::Context>;
/// Stands for a context where llvmpipe is not compiled in.
#[cfg(not(feature = "llvmpipe"))]
type Context = std::convert::Infallible;

/// What engines share over all subjects.
#[derive(Debug)]
pub(crate) struct Engines {
    /// Embree, if its library was named.
    pub(crate) embree: Option<Device>,
    /// llvmpipe, if it was asked for and the machine has it.
    llvmpipe: Option<Context>,
}

impl Engines {
    /// Loads what has to be loaded, for the threads of the current pool. Of the rasterizers, which draw pictures only, those
    /// that are wanted.
    pub(crate) fn open(common: &Common, rasterizers: impl Fn(&str) -> bool) -> Result<Self> {
        // First: it sets variables of the environment, and Embree starts threads.
        let llvmpipe = open_llvmpipe(rasterizers);
        let Some(path) = &common.embree else {
            eprintln!("note: no --embree and no EMBREE_LIBRARY, so Embree is left out");
            return Ok(Self { embree: None, llvmpipe });
        };
        #[cfg(feature = "embree")]
        let embree = embree::device::Device::new(path, rayon::current_num_threads())?;
        #[cfg(feature = "embree")]
        return Ok(Self { embree: Some(embree), llvmpipe });
        #[cfg(not(feature = "embree"))]
        Err(format!("{}: this build has no feature embree", path.display()).into())
    }

    /// The versions of all engines.
    pub(crate) fn versions(&self) -> Value {
        #[cfg_attr(
            not(any(feature = "embree", feature = "llvmpipe")),
            expect(unused_mut, reason = "nothing is loaded")
        )]
        let mut loaded = Vec::new();
        #[cfg(feature = "embree")]
        loaded.extend(self.embree.as_ref().map(|device| ("embree", device.version())));
        #[cfg(feature = "llvmpipe")]
        loaded.extend(self.llvmpipe.as_ref().map(|context| ("llvmpipe", context.version())));
        machine::versions(loaded)
    }

    /// Those that find closest hits: umbel first, then all others whose names are wanted.
    #[cfg_attr(
        not(any(feature = "embree", feature = "llvmpipe", feature = "obvhs")),
        allow(
            unused_mut,
            unused_variables,
            reason = "umbel is alone, or with parry3d, which prepares nothing"
        )
    )]
    pub(crate) fn for_pictures(
        &self,
        picture: &Picture,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Picture>>>> {
        let mut engines: Vec<Box<dyn Engine<Picture>>> =
            vec![Box::new(Umbel::from_scratch()), Box::new(Umbel::keeping_order())];
        #[cfg(feature = "embree")]
        if let Some(device) = &self.embree {
            engines.extend(embree::variants(device, picture, &[8, 16], &wanted)?);
        }
        #[cfg(feature = "llvmpipe")]
        if let Some(context) = &self.llvmpipe {
            engines.extend(llvmpipe::variants(context, picture, &wanted)?);
        }
        #[cfg(feature = "obvhs")]
        engines.extend(obvhs::variants(picture, &wanted));
        #[cfg(feature = "parry")]
        if wanted("parry3d") {
            engines.push(Box::new(parry::Parry));
        }
        Ok(engines)
    }

    /// Those that find shadows: umbel first, then all others whose names are wanted.
    #[cfg_attr(
        not(any(feature = "embree", feature = "obvhs")),
        expect(unused_mut, unused_variables, reason = "umbel is alone")
    )]
    pub(crate) fn for_shadows(
        &self,
        shadow: &Shadow,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Shadow>>>> {
        let mut engines: Vec<Box<dyn Engine<Shadow>>> =
            vec![Box::new(Umbel::from_scratch()), Box::new(Umbel::keeping_order())];
        #[cfg(feature = "embree")]
        if let Some(device) = &self.embree {
            engines.extend(embree::variants(device, shadow, &[8, 16], &wanted)?);
        }
        #[cfg(feature = "obvhs")]
        engines.extend(obvhs::variants(shadow, &wanted));
        Ok(engines)
    }

    /// Those that find open rays: umbel first, then all others whose names are wanted.
    #[cfg_attr(
        not(any(feature = "embree", feature = "obvhs")),
        expect(unused_variables, reason = "umbel is alone")
    )]
    pub(crate) fn for_ambient(
        &self,
        ambient: &Ambient,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Ambient>>>> {
        let mut engines: Vec<Box<dyn Engine<Ambient>>> =
            vec![Box::new(Umbel::from_scratch()), Box::new(Umbel::keeping_order())];
        for grouped in Umbel::grouped() {
            if wanted(grouped.name()) {
                engines.push(Box::new(grouped));
            }
        }
        #[cfg(feature = "embree")]
        if let Some(device) = &self.embree {
            engines.extend(embree::ambient::variants(device, ambient, &wanted)?);
        }
        #[cfg(feature = "obvhs")]
        engines.extend(obvhs::variants(ambient, &wanted));
        Ok(engines)
    }

    /// Those that trace rays that share nothing: umbel first, then all others whose names are wanted.
    #[cfg_attr(
        not(any(feature = "embree", feature = "obvhs")),
        expect(unused_variables, reason = "umbel is alone")
    )]
    pub(crate) fn for_bounces(
        &self,
        bounce: &Bounce,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Bounce>>>> {
        let mut engines: Vec<Box<dyn Engine<Bounce>>> = vec![Box::new(Umbel::from_scratch())];
        #[cfg(feature = "embree")]
        if let Some(device) = &self.embree {
            engines.extend(embree::variants(device, bounce, &[1, 8, 16], &wanted)?);
        }
        #[cfg(feature = "obvhs")]
        engines.extend(obvhs::variants(bounce, &wanted));
        Ok(engines)
    }
}

/// llvmpipe, if it is wanted and the machine has it.
#[cfg_attr(not(feature = "llvmpipe"), expect(unused_variables, reason = "it is not compiled in"))]
fn open_llvmpipe(wanted: impl Fn(&str) -> bool) -> Option<Context> {
    #[cfg(feature = "llvmpipe")]
    if llvmpipe::NAMES.iter().any(|name| wanted(name)) {
        match llvmpipe::gl_context::Context::open(rayon::current_num_threads()) {
            Ok(context) => return Some(context),
            Err(error) => eprintln!("note: {error}, so llvmpipe is left out"),
        }
    }
    None
}
