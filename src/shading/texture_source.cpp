// SPDX-License-Identifier: Apache-2.0
#include "shading/texture_source.h"

#include "plugin/registry.h"

namespace velatura::shading {

Result<const TextureSourceFactory*> texture_source_factory() {
    static const Result<const void*> opened = plugin::open_needed(
        {texture_interface, texture_interface_version, {"asset", "texture"}, "openimageio"});
    if (!opened) return opened.error();
    return static_cast<const TextureSourceFactory*>(*opened);
}

}  // namespace velatura::shading
