// SPDX-License-Identifier: Apache-2.0
#include "shading/texture_cache.h"

#include "base/asset_bytes.h"
#include "image/asset_image.h"
#include "shading/texture_input.h"

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>

#include <atomic>
#include <cmath>
#include <deque>
#include <unordered_map>

namespace velatura::shading {

namespace {

using OIIO::TextureOpt;

constexpr std::string_view udim_token = "<UDIM>";
constexpr int udim_first = 1001;
constexpr int udim_count = 100;  // 1001 … 1100: ten tiles per row
constexpr int udim_row = 10;

/// What open() learns about one file.
struct FileFacts {
    bool is_srgb = false;
    std::string wrap_modes;      // OpenImageIO's "wrapmodes", e.g. "periodic,clamp"
    std::string wrap_s, wrap_t;  // the specification's own metadata: black, clamp, repeat, mirror
    std::string problem;         // empty = readable
};

bool is_srgb(const OIIO::ImageSpec& spec, scene::SourceColorSpace space) {
    if (space != scene::SourceColorSpace::Auto) return space == scene::SourceColorSpace::Srgb;
    // Readers report "sRGB" for every file that says nothing: only the opposite is information
    const OIIO::string_view said = spec.get_string_attribute("oiio:ColorSpace");
    if (OIIO::Strutil::iequals(said, "linear") || OIIO::Strutil::iequals(said, "scene_linear")) {
        return false;
    }
    return spec.format == OIIO::TypeUInt8 && (spec.nchannels == 3 || spec.nchannels == 4);
}

FileFacts examine(const std::string& path, scene::SourceColorSpace space) {
    FileFacts facts;
    const OIIO::ImageSpec config = TextureInput::file_configuration();
    const Result<image::AssetImage> input = image::open_asset_image(path, &config);
    if (!input) {
        facts.problem = input.error().message;
        return facts;
    }
    const OIIO::ImageSpec& spec = (*input)->spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep) {
        facts.problem = "not a flat picture with at least one pixel";
    } else if (spec.width > TextureCache::max_side || spec.height > TextureCache::max_side) {
        facts.problem = "found " + std::to_string(spec.width) + " x " +
                        std::to_string(spec.height) + " pixels, expected at most " +
                        std::to_string(TextureCache::max_side) + " along a side";
    }
    facts.is_srgb = is_srgb(spec, space);
    facts.wrap_modes = spec.get_string_attribute("wrapmodes");
    facts.wrap_s = spec.get_string_attribute("wrapS");
    facts.wrap_t = spec.get_string_attribute("wrapT");
    return facts;
}

/// OpenImageIO calls repeating "periodic"; WrapDefault for what is no wrap mode.
TextureOpt::Wrap named_wrap(const std::string& name) {
    if (name == "repeat") return TextureOpt::WrapPeriodic;
    return TextureOpt::decode_wrapmode(name.c_str());
}

TextureOpt::Wrap wrap_mode(scene::Wrap wrap, const FileFacts& facts, bool is_t) {
    switch (wrap) {
        case scene::Wrap::Black:
            return TextureOpt::WrapBlack;
        case scene::Wrap::Clamp:
            return TextureOpt::WrapClamp;
        case scene::Wrap::Repeat:
            return TextureOpt::WrapPeriodic;
        case scene::Wrap::Mirror:
            return TextureOpt::WrapMirror;
        case scene::Wrap::UseMetadata:
            break;
    }
    const TextureOpt::Wrap named = named_wrap(is_t ? facts.wrap_t : facts.wrap_s);
    if (named != TextureOpt::WrapDefault) return named;
    // Without metadata in the file, black
    const std::string& metadata = facts.wrap_modes;
    if (metadata.empty()) return TextureOpt::WrapBlack;
    TextureOpt::Wrap s = TextureOpt::WrapBlack, t = TextureOpt::WrapBlack;
    TextureOpt::parse_wrapmodes(metadata.c_str(), s, t);
    const TextureOpt::Wrap found = is_t ? t : s;
    return found == TextureOpt::WrapDefault ? TextureOpt::WrapBlack : found;
}

/// The number without its surplus characters: OpenImageIO ends some messages with a line break.
std::string one_line(std::string text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    for (char& c : text) {
        if (c == '\n') c = ' ';
    }
    return text;
}

}  // namespace

struct TextureCache::State {
    struct Entry {
        std::vector<OIIO::TextureSystem::TextureHandle*> tiles;  // one, or [udim_count] with gaps
        bool is_udim = false;
        TextureOpt::Wrap wrap_s = TextureOpt::WrapBlack, wrap_t = TextureOpt::WrapBlack;
        TexelRgba scale{}, bias{}, fallback{};
        std::string file, prim_path;
        SourceLoc loc;
        Diagnostics* diagnostics = nullptr;
        std::atomic<bool> has_failed{false};

        void fail(const std::string& why) {
            if (has_failed.exchange(true)) return;
            diagnostics->error(
                "texture-unreadable", loc, prim_path,
                "cannot read texture '" + file + "': " + why + "; its fallback value is used");
        }
    };

    OIIO::ImageCache* images = nullptr;
    OIIO::TextureSystem* system = nullptr;
    std::deque<Entry> entries;
    std::unordered_map<std::string, OIIO::TextureSystem::TextureHandle*> handles;

    /// Handle of one file in one decoding; the same file is cached once per decoding.
    OIIO::TextureSystem::TextureHandle* handle(const std::string& path, bool decode) {
        const std::string name = (decode ? "velatura-srgb:" : "velatura-raw:") + path;
        const auto [it, is_new] = handles.try_emplace(name, nullptr);
        if (is_new) {
            const OIIO::ImageSpec config = TextureInput::configuration(path, decode);
            images->add_file(OIIO::ustring(name), TextureInput::create, &config);
            it->second = system->get_texture_handle(OIIO::ustring(name));
        }
        return it->second;
    }

    void open_file(Entry& entry, const scene::Texture& texture);
    void open_tiles(Entry& entry, const scene::Texture& texture, size_t token);
};

TextureCache::TextureCache(size_t memory_bytes) : state_(std::make_unique<State>()) {
    state_->images = OIIO::ImageCache::create(false);
    state_->images->attribute("max_memory_MB", float(memory_bytes >> 20));
    state_->images->attribute("autotile", 64);
    state_->images->attribute("automip", 1);
    state_->images->attribute("deduplicate", 0);
    state_->system = OIIO::TextureSystem::create(false, state_->images);
}

TextureCache::~TextureCache() {
    OIIO::TextureSystem::destroy(state_->system);
    OIIO::ImageCache::destroy(state_->images);
}

void TextureCache::State::open_file(Entry& entry, const scene::Texture& texture) {
    const FileFacts facts = examine(texture.file, texture.source_color_space);
    if (!facts.problem.empty()) {
        entry.fail(one_line(facts.problem));
        return;
    }
    entry.wrap_s = wrap_mode(texture.wrap_s, facts, false);
    entry.wrap_t = wrap_mode(texture.wrap_t, facts, true);
    entry.tiles = {handle(texture.file, facts.is_srgb)};
}

void TextureCache::State::open_tiles(Entry& entry, const scene::Texture& texture, size_t token) {
    entry.is_udim = true;
    // A tile does not run into its neighbour: the filter stops at the edge of its own file
    entry.wrap_s = entry.wrap_t = TextureOpt::WrapClamp;
    entry.tiles.assign(udim_count, nullptr);
    bool is_any = false;
    std::string problem = "none of the tiles 1001 to 1100 exists";
    for (int i = 0; i < udim_count; ++i) {
        std::string path = texture.file;
        path.replace(token, udim_token.size(), std::to_string(udim_first + i));
        if (!asset_exists(path)) continue;
        const FileFacts facts = examine(path, texture.source_color_space);
        if (facts.problem.empty()) {
            entry.tiles[size_t(i)] = handle(path, facts.is_srgb);
            is_any = true;
        } else {
            problem = "tile " + std::to_string(udim_first + i) + ": " + one_line(facts.problem);
            entry.fail(problem);
        }
    }
    if (!is_any) {
        entry.fail(problem);
        entry.tiles.clear();
    }
}

TextureCache::Handle TextureCache::open(const scene::Texture& texture,
                                        SourceLoc loc,
                                        const std::string& prim_path,
                                        Diagnostics& diagnostics) {
    State::Entry& entry = state_->entries.emplace_back();
    entry.scale = texture.scale;
    entry.bias = texture.bias;
    entry.fallback = texture.fallback;
    entry.file = texture.authored.empty() ? texture.file : texture.authored;
    entry.prim_path = prim_path;
    entry.loc = loc;
    entry.diagnostics = &diagnostics;
    const size_t token = texture.file.find(udim_token);
    if (texture.file.empty()) {
        // Without a name the fallback is what the scene asks for, and `translate` has said so
        if (!texture.authored.empty()) entry.fail("the name leads to no file");
    } else if (token != std::string::npos) {
        state_->open_tiles(entry, texture, token);
    } else {
        state_->open_file(entry, texture);
    }
    return Handle(state_->entries.size() - 1);
}

bool TextureCache::is_valid(Handle handle) const {
    return !state_->entries[handle].tiles.empty();
}

TexelRgba TextureCache::lookup(Handle handle, const Vec2& st, const Vec2& width) const {
    State::Entry& entry = state_->entries[handle];
    if (entry.tiles.empty() || !std::isfinite(st.x) || !std::isfinite(st.y)) return entry.fallback;
    OIIO::TextureSystem::TextureHandle* tile = entry.tiles[0];
    float s = st.x, t = st.y;
    if (entry.is_udim) {
        const float column = std::floor(s), row = std::floor(t);
        const bool is_inside = column >= 0.0f && column < float(udim_row) && row >= 0.0f &&
                               row < float(udim_count / udim_row);
        tile = is_inside ? entry.tiles[size_t(row) * udim_row + size_t(column)] : nullptr;
        if (tile == nullptr) return entry.fallback;
        s -= column;
        t -= row;
    }
    TextureOpt options;
    options.swrap = entry.wrap_s;
    options.twrap = entry.wrap_t;
    options.interpmode = TextureOpt::InterpBilinear;
    options.mipmode = TextureOpt::MipModeTrilinear;
    // Wider than the picture means its mean; a NaN width means no filter
    const float width_s = width.x > 0.0f ? std::min(width.x, 1.0f) : 0.0f;
    const float width_t = width.y > 0.0f ? std::min(width.y, 1.0f) : 0.0f;
    TexelRgba texel;
    // USD's origin is the lower left corner, OpenImageIO's the upper left
    if (!state_->system->texture(tile, nullptr, options, s, 1.0f - t, width_s, 0.0f, 0.0f, width_t,
                                 4, texel.data())) {
        entry.fail(one_line(state_->system->geterror()));
        return entry.fallback;
    }
    for (size_t c = 0; c < 4; ++c) texel[c] = texel[c] * entry.scale[c] + entry.bias[c];
    return texel;
}

}  // namespace velatura::shading
