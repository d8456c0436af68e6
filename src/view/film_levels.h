// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/levels.h"
#include "film/film.h"
#include "image/window.h"

#include <memory>

namespace velatura::view {

/// The layers of a film as its file would hold them now, for the mixer.
/// Args:   reduction: pixels of the image along a side of one of the film: 1, but for drafts.
///         frame: the whole image in its own pixels.
///         behind: an image of the same layers that shows around the film's window; null: nothing
///         does.
/// Errors: "no-samples", "closure-failed", those of LayerStack::from_image and Levels::make.
Result<std::shared_ptr<const compositor::window::Levels>> film_levels(
    const film::Film& film,
    const film::FileInfo& info,
    int reduction,
    const image::Window& frame,
    const image::Image* behind = nullptr);

}  // namespace velatura::view
