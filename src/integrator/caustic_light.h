// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/sample_radiance.h"
#include "integrator/path.h"
#include "integrator/tracer_context.h"

namespace velatura::integrator {

/// Deposits light by chains that are solved for (CausticSampler). Not without one.
void add_caustics(const TracerContext& context,
                  Path& path,
                  const Vertex& vertex,
                  film::SampleRadiance& out);

}  // namespace velatura::integrator
