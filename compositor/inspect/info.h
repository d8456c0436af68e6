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

/// Whether the image has a Cryptomatte with its ids, not its name alone.
bool has_mattes(const image::Image& image, const std::string& path);

/// Of a file without light that has Cryptomattes: its objects, and how much of the image each
/// covers. path: that of the image, for manifests beside it.
std::string mattes_info_text(const image::Image& image, const std::string& path);

/// The same as JSON.
std::string mattes_info_json(const image::Image& image, const std::string& path);

}  // namespace velatura::compositor::inspect
