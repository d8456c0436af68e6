// SPDX-License-Identifier: Apache-2.0
#include "render/draft_tracer.h"

namespace velatura::render {

std::unique_ptr<const integrator::PathTracer> make_draft_tracer(
    const Renderer& renderer, const integrator::MatteIds* mattes) {
    integrator::PathTracerOptions options = renderer.settings().tracer;
    options.mattes = mattes;
    options.disable_lens = renderer.scene().settings.disable_depth_of_field;
    // That one needs what trial paths find
    if (options.estimator.roulette == integrator::Roulette::Efficiency)
        options.estimator.roulette = integrator::Roulette::Throughput;
    return std::make_unique<const integrator::PathTracer>(renderer.world(),
                                                          renderer.settings().layers, options);
}

}  // namespace velatura::render
