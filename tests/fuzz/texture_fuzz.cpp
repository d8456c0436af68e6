// SPDX-License-Identifier: Apache-2.0
#include "built_plugin.h"
#include "fuzz_targets.h"
#include "image/image_library.h"
#include "shading/texture_source.h"
#include "temporary_file.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace velatura::fuzz {

namespace {

constexpr std::array<const char*, 6> kinds = {"png", "jpg", "hdr", "exr", "tif", "tx"};
constexpr int max_side = 2048;
/// Decoders are to crash here, where they are looked at, and not in a decoder process.
constexpr DecodeLimits in_process = {.is_sandboxed = false};

/// Texels of the finest level, of levels between and of the coarsest, at corners and inside.
void look_up(const shading::TextureFile& file) {
    for (const float width : {0.0f, 0.01f, 0.2f, 1.0f})
        for (const Vec2& st : {Vec2(0.0f), Vec2(0.51f, 0.37f), Vec2(1.0f), Vec2(-3.2f, 7.9f)}) {
            shading::TexelRgba texel = {};
            if (!file.lookup(st, Vec2(width), texel)) return;
            for (const float value : texel)
                if (!std::isfinite(value)) std::abort();
        }
}

}  // namespace

/// The first byte is a kind of file, the others are any bytes: an image and a texture with finite
/// texels, or refused.
void texture(std::string_view bytes) {
    static const auto* factory = static_cast<const shading::TextureSourceFactory*>(built_interface(
        shading::texture_interface, shading::texture_interface_version, "asset", "texture"));
    static const auto* images = static_cast<const image::ImageLibrary*>(built_interface(
        image::image_interface, image::image_interface_version, "asset", "picture"));
    if (factory == nullptr || images == nullptr || bytes.empty()) return;
    const size_t kind = size_t(static_cast<unsigned char>(bytes[0])) % kinds.size();
    const std::string file = memory_file(std::string("fuzz.") + kinds[kind], bytes.substr(1));
    if (const auto source = factory->make(size_t(16) << 20, in_process))
        if (const auto opened =
                (*source)->open(file, scene::SourceColorSpace::Auto, scene::Wrap::UseMetadata,
                                scene::Wrap::Mirror, max_side))
            look_up(**opened);
    images->limit(in_process);
    if (const auto image = images->open(file)) {
        const image::ImageInfo& facts = (*image)->facts();
        if (facts.width < 1 || facts.height < 1 || facts.channels < 1 || facts.width > max_side ||
            facts.height > max_side)
            return;
        const int channels = facts.channels >= 3 ? 3 : 1;
        std::vector<float> values(size_t(facts.width) * size_t(facts.height) * size_t(channels));
        (void)(*image)->read(channels, values).has_value();
    }
}

}  // namespace velatura::fuzz
