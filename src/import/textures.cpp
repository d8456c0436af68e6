// SPDX-License-Identifier: Apache-2.0
#include "base/asset_roots.h"
#include "import/context.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace velatura::import {

namespace fs = std::filesystem;

std::string file_of_uri(std::string name) {
    if (name.starts_with("file://")) name.erase(0, 7);
    std::string out;
    for (size_t i = 0; i < name.size(); ++i) {
        unsigned byte = 0;
        const char* const digits = name.data() + i + 1;
        if (name[i] == '%' && i + 2 < name.size() &&
            std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2 && byte != 0) {
            out += char(byte);
            i += 2;
        } else {
            out += name[i] == '\\' ? '/' : name[i];
        }
    }
    return out;
}

namespace {

/// "@path@" as the layer wants it: relative to the output, never mistaken for a search path.
std::string anchored(const fs::path& file, const fs::path& output) {
    const std::string relative = file.lexically_proximate(output.parent_path()).generic_string();
    const bool is_anchored = relative.starts_with("../") || relative.starts_with("/");
    return is_anchored ? relative : "./" + relative;
}

/// Suffix of an image by its first bytes, else what Assimp says.
std::string image_suffix(std::string_view bytes, const aiTexture& texture) {
    if (bytes.starts_with("\x89PNG")) return "png";
    if (bytes.starts_with("\xff\xd8\xff")) return "jpg";
    if (bytes.starts_with("RIFF")) return "webp";
    if (bytes.starts_with("\xabKTX")) return "ktx2";
    if (bytes.starts_with("BM")) return "bmp";
    if (bytes.starts_with("DDS ")) return "dds";
    const std::string hint = valid_name(texture.achFormatHint, "bin");
    return hint;
}

std::string write_embedded(Context& ctx, size_t index) {
    if (index >= ctx.scene.mNumTextures) return {};
    if (!ctx.embedded[index].empty()) return ctx.embedded[index];
    const aiTexture& texture = *ctx.scene.mTextures[index];
    if (texture.mHeight != 0 || texture.pcData == nullptr) {
        ctx.warn("import-texture", "an embedded image without a file format is skipped");
        return {};
    }
    const std::string_view bytes(reinterpret_cast<const char*>(texture.pcData), texture.mWidth);
    const std::string stem =
        valid_name(fs::path(texture.mFilename.C_Str()).stem().string(), "texture");
    const fs::path file =
        ctx.texture_folder() / fmt::format("{}_{}.{}", stem, index, image_suffix(bytes, texture));
    ctx.images.emplace_back(file, bytes);
    ++ctx.summary.textures;
    return ctx.embedded[index] = anchored(file, ctx.output);
}

}  // namespace

std::string texture_asset(Context& ctx, const std::string& name, const std::string& material) {
    if (name.empty()) return {};
    if (name[0] == '*') {
        size_t index = 0;
        std::from_chars(name.data() + 1, name.data() + name.size(), index);
        return write_embedded(ctx, index);
    }
    for (size_t i = 0; i < ctx.scene.mNumTextures; ++i)
        if (name == ctx.scene.mTextures[i]->mFilename.C_Str()) return write_embedded(ctx, i);
    const fs::path wanted = fs::path(file_of_uri(name));
    const fs::path beside = ctx.file.parent_path() / wanted;
    // Exporters leave paths of the machine they ran on
    const fs::path by_name = ctx.file.parent_path() / wanted.filename();
    for (const fs::path& file : {beside, by_name}) {
        std::error_code error;
        if (!fs::exists(file, error)) continue;
        if (const auto opened = asset_roots().open(file.string()); !opened) {
            ctx.diagnostics.error(opened.error().code, ctx.loc, "",
                                  fmt::format("texture \"{}\" of material \"{}\" is skipped: {}",
                                              name, material, opened.error().message));
            return {};
        }
        return anchored(file.lexically_normal(), ctx.output);
    }
    ctx.warn("import-texture",
             fmt::format("texture \"{}\" of material \"{}\" does not exist", name, material));
    return anchored((wanted.is_absolute() ? by_name : beside).lexically_normal(), ctx.output);
}

}  // namespace velatura::import
