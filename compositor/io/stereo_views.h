// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// Stereo and other views of one file, as OpenEXR keeps them: parts with an attribute `view`, parts
/// called `left` and `right` that hold all its colors, or one part whose attribute `multiView`
/// lists the views that names of channels hold (`right.R`, `key.right.R`; bare channels are of the
/// first).
class StereoViews {
  public:
    /// `asked`: empty takes the first view. Errors: "unknown-view".
    static Result<StereoViews> of(const image::Image& image, const std::string& asked);

    /// Two or more, or none.
    const std::vector<std::string>& names() const { return names_; }

    /// That which is read; empty: the file has only one.
    const std::string& chosen() const { return chosen_; }

    /// False for parts of other views.
    bool has_part(size_t part) const { return !is_other_[part]; }

    /// Without the view at its end.
    std::string part_name(const image::Part& part) const;

    /// The name of a channel without its view; none: it is of another view.
    std::optional<std::string> channel_name(const image::Part& part,
                                            const std::string& channel) const;

  private:
    struct Split {
        std::string view, name;
    };

    Split split(const std::string& channel) const;

    std::vector<std::string> names_;
    std::string chosen_;
    std::vector<bool> is_other_;
    bool has_prefixes_ = false;
};

}  // namespace io
}  // namespace velatura::compositor
