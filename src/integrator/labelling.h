// SPDX-License-Identifier: Apache-2.0
// What path layers are told of a path: what each scattering is, by its parts
// (docs/reference/light_path_expressions.md).
#pragma once

#include "film/sample_radiance.h"

namespace velatura::integrator {

/// Null where there are no path layers.
inline film::PathLabels* labels_of(film::SampleRadiance& out) {
    return out.labels();
}

}  // namespace velatura::integrator
