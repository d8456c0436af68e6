// SPDX-License-Identifier: Apache-2.0
#include "plugin/plugin_api.h"
#include "plugins/openimageio/image_files.h"
#include "plugins/openimageio/textures.h"

namespace {

using namespace velatura;

const plugins::openimageio::Images images;
const plugins::openimageio::TextureSystemFactory textures;
const plugin::InterfaceEntry interfaces[] = {
    {image::image_interface, image::image_interface_version,
     static_cast<const image::ImageLibrary*>(&images)},
    {shading::texture_interface, shading::texture_interface_version,
     static_cast<const shading::TextureSourceFactory*>(&textures)}};
const plugin::PluginInfo info = {plugin::abi_version, "openimageio", interfaces, 2};

}  // namespace

extern "C" [[gnu::visibility("default")]] const velatura::plugin::PluginInfo* velatura_plugin_v1();

const velatura::plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
