// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <memory>
#include <string>
#include <vector>

namespace velatura::image {

/// The working space of a file for DisplayTransform: ACEScg is told by its red primary; all else is
/// taken as linear Rec.709, which is empty.
std::string working_space_of(const Image& image);

/// A display of the config in use and its views, in the config's order.
struct DisplayViews {
    std::string display;
    std::vector<std::string> views;
};

/// What DisplayTransform::make can be asked for, the config's default display first.
/// Errors: "ocio-config".
Result<std::vector<DisplayViews>> display_views();

/// Turns scene-linear pictures into what a monitor shows, through OpenColorIO: the config of $OCIO,
/// else a small built-in one with display `sRGB` and the views `ACES` (SDR video output transform),
/// `sRGB` (no tone mapping) and `Raw`, for linear Rec.709 and ACEScg.
class DisplayTransform {
  public:
    /// Empty names mean the config's defaults. `working_space`: `lin_rec709` or `ACEScg` for the
    /// built-in config; for another config a colour space or role of it, empty = role scene_linear.
    /// Errors: "ocio-config" (config cannot be read), "ocio-view" (no such display, view or colour
    /// space; the message lists what there is).
    static Result<DisplayTransform> make(const std::string& display,
                                         const std::string& view,
                                         const std::string& working_space = "");
    ~DisplayTransform();
    DisplayTransform(DisplayTransform&&) noexcept;
    DisplayTransform& operator=(DisplayTransform&&) noexcept;

    /// In place, [pixels][3].
    void apply(std::vector<float>& rgb) const;

  private:
    struct Impl;
    explicit DisplayTransform(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace velatura::image
