// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/exports/export.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

/// What all scripts say of the file: everything of a recipe but its terms. Errors as mix_recipe.
Result<MixRecipe> file_recipe(const LayerStack& stack, const Look& look, const std::string& file);

/// The files of a sequence that are here, without pixels: those that store other layers than
/// `stack` and each other (black layers are not stored). None for a single file.
std::vector<LayerStack> other_frames(const LayerStack& stack, const std::string& file);

/// Adds the terms of a frame that are not there yet, in the order of the header.
void add_missing_terms(const std::vector<mix::MixPlan::Term>& from,
                       const layers::LayerHeader& header,
                       std::vector<mix::MixPlan::Term>& to);

/// A layer with its places in the file, or in that of another frame; none where no one has its
/// R, G and B.
std::optional<MixRecipe::Term> stored_term(const LayerStack& stack,
                                           std::span<const LayerStack> others,
                                           const std::string& layer,
                                           const std::array<float, 3>& gain = {1, 1, 1});

/// True where oiiotool takes the channels by their names.
bool has_plain_channels(const MixRecipe::Term& term);

/// Letters, digits and `_`, which every program takes for a name.
std::string plain_name(const std::string& layer);

/// For Python, and for one line of a comment.
std::string python_quoted(const std::string& text);

/// What the script is, and the look, in comments.
std::string comment(const MixRecipe& recipe);

}  // namespace velatura::compositor::exports
