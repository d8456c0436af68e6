// SPDX-License-Identifier: Apache-2.0
#include "image/picture_library.h"

#include "plugin/registry.h"

namespace velatura::image {

Result<const PictureLibrary*> picture_library() {
    static const Result<const PictureLibrary*> opened = []() -> Result<const PictureLibrary*> {
        const Result<const void*> found = plugin::open_needed(
            {picture_interface, picture_interface_version, {"asset", "picture"}, "openimageio"});
        if (!found) return found.error();
        return static_cast<const PictureLibrary*>(*found);
    }();
    if (opened) (*opened)->limit(decode_limits());
    return opened;
}

}  // namespace velatura::image
