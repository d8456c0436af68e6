// SPDX-License-Identifier: Apache-2.0
#include "shading/texture_cache.h"

#include "base/asset_bytes.h"
#include "base/asset_roots.h"
#include "base/limits.h"
#include "base/process/memory_limit.h"
#include "base/udim.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::shading {

namespace {

using OpenedFile = Result<std::unique_ptr<TextureFile>>;

}  // namespace

struct TextureCache::State {
    struct Entry {
        std::vector<std::unique_ptr<TextureFile>> tiles;  // one, or [udim_count] with gaps
        bool is_udim = false;
        TexelRgba scale{}, bias{}, fallback{};
        std::optional<scene::ColorDecoding> decoding;
        std::string file, prim_path;
        SourceLoc loc;
        Diagnostics* diagnostics = nullptr;
        std::atomic<size_t>* failures = nullptr;
        std::atomic<bool> has_failed{false};

        void fail(const std::string& why) {
            if (has_failed.exchange(true)) return;
            ++*failures;
            diagnostics->error(
                "texture-unreadable", loc, prim_path,
                fmt::format(
                    "cannot read texture '{}': {}; using its fallback ({:g}, {:g}, {:g}, {:g})",
                    file, why, fallback[0], fallback[1], fallback[2], fallback[3]));
        }
    };

    explicit State(size_t memory) : memory_bytes(memory) {}

    std::atomic<size_t> memory_bytes;
    // Outlives the files of the entries
    std::unique_ptr<TextureSource> source;
    std::deque<Entry> entries;
    std::atomic<size_t> failures{0};

    /// The source is made for the first file: whoever has none opens no plugin.
    OpenedFile open(const std::string& path,
                    const scene::Texture& texture,
                    scene::Wrap wrap_s,
                    scene::Wrap wrap_t) {
        const Result<std::string> admitted = admit_asset(path);
        if (!admitted) return admitted.error();
        if (!source) {
            const Result<const TextureSourceFactory*> factory = texture_source_factory();
            if (!factory) return factory.error();
            Result<std::unique_ptr<TextureSource>> made =
                (*factory)->make(memory_bytes, decode_limits());
            if (!made) return made.error();
            source = std::move(*made);
        }
        return source->open(*admitted, texture.colors.curve, wrap_s, wrap_t, limits().image_side);
    }

    void open_file(Entry& entry, const scene::Texture& texture);
    void open_tiles(Entry& entry, const scene::Texture& texture);
};

TextureCache::TextureCache(size_t memory_bytes) : state_(std::make_unique<State>(memory_bytes)) {}

TextureCache::~TextureCache() = default;

void TextureCache::State::open_file(Entry& entry, const scene::Texture& texture) {
    OpenedFile opened = open(texture.file, texture, texture.wrap_s, texture.wrap_t);
    if (opened) {
        entry.tiles.push_back(std::move(*opened));
    } else {
        entry.fail(opened.error().message);
    }
}

void TextureCache::State::open_tiles(Entry& entry, const scene::Texture& texture) {
    entry.is_udim = true;
    entry.tiles.resize(udim_count);
    bool is_any = false;
    std::string problem = "none of the UDIM tiles 1001 to 1100 exists";
    for (int i = 0; i < udim_count; ++i) {
        const std::string path = udim_tile_name(texture.file, i);
        if (!asset_exists(path)) continue;
        // A tile does not run into its neighbor: the filter stops at the edge of its own file
        OpenedFile opened = open(path, texture, scene::Wrap::Clamp, scene::Wrap::Clamp);
        if (opened) {
            entry.tiles[size_t(i)] = std::move(*opened);
            is_any = true;
        } else {
            problem = "tile " + std::to_string(udim_first + i) + ": " + opened.error().message;
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
    const MemoryLimit::Exemption granted;
    State::Entry& entry = state_->entries.emplace_back();
    entry.scale = texture.scale;
    entry.bias = texture.bias;
    entry.fallback = texture.fallback;
    if (!texture.colors.decoding.is_identity()) entry.decoding = texture.colors.decoding;
    entry.file = texture.authored.empty() ? texture.file : texture.authored;
    entry.prim_path = prim_path;
    entry.loc = loc;
    entry.diagnostics = &diagnostics;
    entry.failures = &state_->failures;
    if (texture.file.empty()) {
        // Without a name the fallback is what the scene asks for, and `translate` has said so
        if (!texture.authored.empty()) entry.fail("file not found");
    } else if (is_udim_name(texture.file)) {
        state_->open_tiles(entry, texture);
    } else {
        state_->open_file(entry, texture);
    }
    return Handle(state_->entries.size() - 1);
}

bool TextureCache::is_valid(Handle handle) const {
    return !state_->entries[handle].tiles.empty();
}

size_t TextureCache::whole_bytes() const {
    return state_->source ? state_->source->whole_bytes() : 0;
}

size_t TextureCache::memory_bytes() const {
    return state_->memory_bytes;
}

void TextureCache::set_memory(size_t bytes) const {
    state_->memory_bytes = bytes;
    if (state_->source) state_->source->set_memory(bytes);
}

void TextureCache::drop_tiles() const {
    if (state_->source) state_->source->drop_tiles();
}

size_t TextureCache::failed_count() const {
    return state_->failures;
}

TexelRgba TextureCache::lookup(Handle handle, const Vec2& st, const Vec2& width) const {
    State::Entry& entry = state_->entries[handle];
    if (entry.tiles.empty() || !std::isfinite(st.x) || !std::isfinite(st.y)) return entry.fallback;
    const TextureFile* tile = entry.tiles[0].get();
    float s = st.x, t = st.y;
    if (entry.is_udim) {
        const float column = std::floor(s), row = std::floor(t);
        const bool is_inside = column >= 0.0f && column < float(udim_row) && row >= 0.0f &&
                               row < float(udim_count / udim_row);
        tile = is_inside ? entry.tiles[size_t(row) * udim_row + size_t(column)].get() : nullptr;
        if (tile == nullptr) return entry.fallback;
        s -= column;
        t -= row;
    }
    // Wider than the image means its mean; a NaN width means no filter
    const float width_s = width.x > 0.0f ? std::min(width.x, 1.0f) : 0.0f;
    const float width_t = width.y > 0.0f ? std::min(width.y, 1.0f) : 0.0f;
    TexelRgba texel;
    const MemoryLimit::Exemption granted;
    if (!tile->lookup(Vec2(s, t), Vec2(width_s, width_t), texel)) {
        entry.fail(state_->source->lookup_error());
        return entry.fallback;
    }
    if (entry.decoding) {
        const Vec3d color = (*entry.decoding)({texel[0], texel[1], texel[2]});
        for (size_t c = 0; c < 3; ++c) texel[c] = float(color[int(c)]);
    }
    for (size_t c = 0; c < 4; ++c) texel[c] = texel[c] * entry.scale[c] + entry.bias[c];
    return texel;
}

}  // namespace velatura::shading
