// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_set.h"

#include <vector>

namespace velatura::film {

/// emission, and what each lobe brings at the first scattering and later: they add up to the
/// beauty. Names are Arnold's words where it has one.
std::vector<accumulate::PathLayer> lobe_layers();

/// The lobes of the lobe matrix: the same, and emission, without regard to bounces.
std::vector<accumulate::PathLayer> lobes_of_matrix();

}  // namespace velatura::film
