// SPDX-License-Identifier: Apache-2.0
#include "image/picture_library.h"

#include "plugin/registry.h"

namespace velatura::image {

Result<const PictureLibrary*> picture_library() {
    static const Result<const void*> opened = plugin::open_needed(
        {picture_interface, picture_interface_version, {"asset", "picture"}, "openimageio"});
    if (!opened) return opened.error();
    return static_cast<const PictureLibrary*>(*opened);
}

}  // namespace velatura::image
