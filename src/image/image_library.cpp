// SPDX-License-Identifier: Apache-2.0
#include "image/image_library.h"

#include "plugin/registry.h"

namespace velatura::image {

Result<const ImageLibrary*> image_library() {
    static const Result<const ImageLibrary*> opened = []() -> Result<const ImageLibrary*> {
        const Result<const void*> found = plugin::open_needed(
            {image_interface, image_interface_version, {"asset", "picture"}, "openimageio"});
        if (!found) return found.error();
        return static_cast<const ImageLibrary*>(*found);
    }();
    if (opened) (*opened)->limit(decode_limits());
    return opened;
}

}  // namespace velatura::image
