// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "scene/texture.h"
#include "shading/texture_source.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace velatura::shading {

/// The file textures of a scene, mip-mapped and cached in tiles by a TextureSource, whose plugin
/// the first one opens. Lookups are thread-safe.
class TextureCache {
  public:
    using Handle = uint32_t;
    /// Files larger than this many pixels along a side are refused.
    static constexpr size_t usual_bytes = size_t(1) << 30;

    explicit TextureCache(size_t memory_bytes = usual_bytes);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;
    TextureCache& operator=(const TextureCache&) = delete;

    /// Opens a texture (for <UDIM> names: every tile on disk). Not thread-safe. One error per
    /// broken file, or texture that no plugin is there for, with `loc` and `prim_path`.
    Handle open(const scene::Texture& texture,
                SourceLoc loc,
                const std::string& prim_path,
                Diagnostics& diagnostics);

    /// texel · scale + bias at st, (0,0) the lower left corner; the fallback when the file could
    /// not be opened. width: extent of the filter in st units along s and t (0 = bilinear between
    /// the finest texels).
    TexelRgba lookup(Handle handle, const Vec2& st, const Vec2& width) const;

    bool is_valid(Handle handle) const;

    /// What all of the textures would come to, bytes; see TextureSource::whole_bytes.
    size_t whole_bytes() const;
    /// What the cache may come to, bytes.
    size_t memory_bytes() const;
    /// Another size for the cache, also while textures are looked up.
    void set_memory(size_t bytes) const;
    /// Gives up what it holds. Needs all lookups at rest.
    void drop_tiles() const;
    /// Textures of which a file could not be opened or read so far: their fallback was used.
    size_t failed_count() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace velatura::shading
