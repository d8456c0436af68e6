// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/matte_ids.h"
#include "integrator/path_tracer.h"
#include "render/renderer.h"

#include <memory>

namespace velatura::render {

/// A tracer of the renderer's built world without a prepass, for images that are soon replaced:
/// caustics by paths, neither guiding nor splitting. mattes: null without Cryptomattes; like the
/// renderer it must outlive the tracer.
std::unique_ptr<const integrator::PathTracer> make_draft_tracer(const Renderer& renderer,
                                                                const integrator::MatteIds* mattes);

}  // namespace velatura::render
