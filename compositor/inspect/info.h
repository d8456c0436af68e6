// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"

#include <string>

namespace velatura::compositor::inspect {

/// What a file holds, as text for people: image, samples, groups, layers with their share of the
/// light, closure.
std::string info_text(const LayerStack& stack);

/// The same as JSON (`velatura.info/1`).
std::string info_json(const LayerStack& stack);

}  // namespace velatura::compositor::inspect
