//! The sentences of the page of `umbel trade`: what was measured, what the words mean, and which knobs are no trade.

use crate::trade::args::ModeArg;
use crate::trade::report::Findings;
use crate::trade::settings::REFERENCE_RATE;

/// What was measured, and what the errors are.
pub(crate) fn what_was_measured(found: &Findings) -> String {
    let (items, rounds) = (found.items, found.rounds);
    let reference = found.reference.unwrap_or(0);
    let of = match found.mode {
        ModeArg::Render => format!(
            "A picture was rendered with several settings. More samples per pixel make edges smoother and take longer. \
             The error of a setting is how far its colours are from those of the same picture with {reference} samples \
             per pixel. Colours run from 0 (black) to 1 (white). {items} pixels were compared."
        ),
        ModeArg::Shadow => format!(
            "Shadows in a picture were found in two ways. The exact mask asks for each pixel whether anything stands \
             between its surface and the light. A cube map stores, for a grid of directions around the light, how far \
             the light gets; pixels are then looked up in it. Its time is that of making the map and of looking up. \
             A pixel is 1 where light arrives and 0 in shadow. The error of a setting is how far it is from the exact \
             mask. {items} pixels that see a surface were compared."
        ),
        ModeArg::Reyes => format!(
            "A picture of surfaces that are made on demand was rendered with several settings. A smaller shading rate makes \
             smaller micropolygons, which follow the surface more closely; more samples per pixel make edges smoother. Both \
             take longer. The error of a setting is how far its colours are from those of the same picture with {reference} \
             samples per pixel and a shading rate of {REFERENCE_RATE}. Colours run from 0 (black) to 1 (white). {items} \
             pixels were compared."
        ),
        ModeArg::Bake => format!(
            "For each of {items} points on the surface of the scene (receivers), rays are sent out to see how much of the sky \
             is open: 1 is all of it, 0 nothing. More rays take longer and come nearer to the truth. The error of a \
             setting is how far its numbers are from those with {reference} rays, whose directions have nothing to do \
             with those that are measured."
        ),
    };
    format!(
        "{of} Each setting ran once to warm up and then {rounds} times, all in turn; a time is the median of those. It is \
         the time from the loaded scene to the finished numbers: reading and writing files is left out."
    )
}

/// What the colours of the small pictures mean.
pub(crate) fn picture_legend(mode: ModeArg) -> &'static str {
    match mode {
        ModeArg::Shadow => {
            "Gray: right, bright where light arrives. Orange: the setting says shadow where light arrives. Blue: the \
             setting says light where there is shadow. Slate: no surface."
        }
        _ => {
            "Black: no error. Purple, orange, yellow: growing error, brightest from 0.25 on. Slate: nothing to \
             compare. Where pixels were joined to fit, the worst of them is shown."
        }
    }
}

/// Words of the page, and what they mean.
pub(crate) fn glossary() -> [(&'static str, &'static str); 8] {
    [
        (
            "RMSE",
            "the root of the mean squared error: one number for how wrong all values are together. 0 is perfect; 0.01 is two or \
             three of the 255 steps that a usual picture has.",
        ),
        ("greatest error", "the error of the single worst value."),
        (
            "differ",
            "how many pixels or points have any other value than the reference, be it by ever so little.",
        ),
        (
            "front",
            "the settings for which no other one is both faster and better. Only these are worth choosing from; the \
             first is the fastest, the last the best.",
        ),
        ("default", "what the command does when you ask for nothing."),
        (
            "--accuracy fast",
            "a decision that is too close for rounded numbers stays as rounding has it. Without it \
             each is settled as exact arithmetic would.",
        ),
        (
            "depth map",
            "a square grid of distances, seen along one direction from far away. What lies behind the first surface that \
             a grid cell sees is taken for dark; within half a cell of an edge that may be wrong.",
        ),
        ("median", "the middle one of several times: half of the runs were faster, half slower."),
    ]
}

/// Knobs that change what is asked, so that there is nothing to measure an error against.
pub(crate) fn choices(mode: ModeArg) -> &'static [(&'static str, &'static str)] {
    match mode {
        ModeArg::Render => &[
            ("--size", "how many pixels there are: time grows with them, more slowly than their number"),
            ("--light, --sun", "each light adds the time of its shadows"),
        ],
        ModeArg::Reyes => &[
            ("--size", "how many pixels there are: micropolygons and time grow with them"),
            ("--displace, --height, --subdivide", "what the surface is: rough ones cost more"),
        ],
        ModeArg::Shadow => &[
            ("--size", "how many pixels ask: the time of the exact mask grows with them"),
            ("--samples", "how smooth the edges of a mask are; each sample takes the time of one mask"),
        ],
        ModeArg::Bake => &[
            (
                "--max-distance",
                "how far away something may stand and still darken: a choice of look. Short distances are faster",
            ),
            ("--falloff, --weighting", "how much distance and angle count: a choice of look"),
            (
                "--texels, --texel-samples",
                "how finely the surface is covered: time grows with the number of points",
            ),
        ],
    }
}
