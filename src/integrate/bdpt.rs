//! Bidirectional path tracing: all strategies of all depths, weighed against each other.
//! Independent samples, a fixed number per pixel.

use super::sampled::part::PartFilm;
use super::sampled::{self, Method};
use super::{Render, Run, StrategyPictures};
use crate::checkpoint::{Malformed, Reader};
use crate::simd::Lanes;
use crate::simd::rng::Purpose;
use crate::transport::bidirectional::{BidirectionalLayout, Strategy};

pub(super) fn render<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    let mut layout = BidirectionalLayout::new(run.world);
    let mut films = Vec::new();
    if run.settings.strategies {
        layout = layout.with_parts();
        films = (layout.strategies().iter())
            .map(|strategy| StrategyFilms::new(run, *strategy))
            .collect();
    }
    let method = Method {
        name: "bdpt",
        purpose: Purpose::Bidirectional,
        layout: &layout.at,
        splats: true,
        evaluate: &|samples, n, paths| {
            (run.world).evaluate_bidirectional::<L>(&layout, samples, n, paths);
        },
        collect: &|paths, numbers| {
            for (films, parts) in films.iter().zip(&paths.splats.parts) {
                let places = match films.strategy.t {
                    1 => &paths.splats.light[films.strategy.s as usize - 2],
                    _ => &paths.splats.camera,
                };
                let at = || parts.iter().zip(places);
                let weighted = at().map(|(part, at)| (part.weighted, at.raster));
                films.weighted.add(weighted, numbers);
                let unweighted = at().map(|(part, at)| (part.unweighted, at.raster));
                films.unweighted.add(unweighted, numbers);
            }
        },
    };
    // Pictures of strategies are not in states.
    let run = Run {
        keeps: run.keeps && films.is_empty(),
        ..*run
    };
    let mut sampled = sampled::render::<L>(&run, &method, from)?;
    sampled.render.strategies = (films.iter())
        .map(|films| StrategyPictures {
            strategy: films.strategy,
            weighted: films.weighted.resolve(&sampled),
            unweighted: films.unweighted.resolve(&sampled),
        })
        .collect();
    Ok(sampled.render)
}

/// A strategy's part of the picture, and the picture it makes alone.
struct StrategyFilms {
    strategy: Strategy,
    weighted: PartFilm,
    unweighted: PartFilm,
}

impl StrategyFilms {
    fn new(run: &Run, strategy: Strategy) -> Self {
        let film = || PartFilm::new(run, strategy.t == 1);
        Self {
            strategy,
            weighted: film(),
            unweighted: film(),
        }
    }
}
