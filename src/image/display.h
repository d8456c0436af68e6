// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/file_color.h"

#include <memory>
#include <string>
#include <vector>

namespace velatura::image {

/// A display of the config in use and its views, in the config's order.
struct DisplayViews {
    std::string display;
    std::vector<std::string> views;
};

/// What DisplayTransform::make can be asked for, the config's default display first.
/// Errors: "ocio-config".
Result<std::vector<DisplayViews>> display_views();

/// Turns scene-linear images into what a monitor shows, through OpenColorIO: the config of $OCIO,
/// else a small built-in one with display `sRGB` and the views `ACES` (SDR video output transform),
/// `sRGB` (no tone mapping) and `Raw`.
class DisplayTransform {
  public:
    /// Empty names mean the config's defaults. What the file's numbers mean, `color` says: they
    /// enter the config as its own space of that name, else by a matrix into one that it has. An
    /// empty `color` is the role scene_linear. Errors: "ocio-config" (config cannot be read),
    /// "ocio-view" (no such display or view; the message lists what there is).
    static Result<DisplayTransform> make(const std::string& display,
                                         const std::string& view,
                                         const FileColor& color = {});
    ~DisplayTransform();
    DisplayTransform(DisplayTransform&&) noexcept;
    DisplayTransform& operator=(DisplayTransform&&) noexcept;

    /// What is not known of the colors and what was assumed: those of the FileColor, and of the
    /// config.
    const std::vector<std::string>& warnings() const;

    /// In place, [pixels][3].
    void apply(std::vector<float>& rgb) const;

  private:
    struct Impl;
    explicit DisplayTransform(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace velatura::image
