// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/limits.h"
#include "base/math.h"
#include "base/result.h"
#include "scene/texture.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace velatura::shading {

/// Under this name and version a plugin hands out a `const TextureSourceFactory*`. The version
/// changes whenever this header or a type that it mentions does.
inline constexpr const char* texture_interface = "textures";
inline constexpr uint32_t texture_interface_version = 4;

/// RGBA of a texture lookup, scene-linear.
using TexelRgba = std::array<float, 4>;

/// An image that is looked up by coordinates.
class TextureFile {
  public:
    virtual ~TextureFile() = default;

    /// The filtered texel at st, (0,0) the lower left corner, both finite. width: extent of the
    /// filter in st units along s and t, each in [0, 1]. Thread-safe; does not throw.
    /// Returns: false when the file cannot be read; TextureSource::lookup_error says why.
    virtual bool lookup(const Vec2& st, const Vec2& width, TexelRgba& texel) const = 0;
};

/// Files that share one cache of tiles, which must outlive them. Texels are decoded (sRGB transfer
/// curve) and widened to RGBA when a tile is read, before any filtering: 1 channel gives
/// (c, c, c, 1), 2 give (c0, c0, c0, c1), 3 give (r, g, b, 1). NaN and infinite texels read as 0.
class TextureSource {
  public:
    virtual ~TextureSource() = default;

    /// Opens a file in one decoding and with one way to go on beyond its borders. `max_side`: limit
    /// on its pixels along a side. Not thread-safe; does not throw. Errors: "image-open", on one
    /// line.
    virtual Result<std::unique_ptr<TextureFile>> open(const std::string& file,
                                                      scene::SourceColorSpace space,
                                                      scene::Wrap wrap_s,
                                                      scene::Wrap wrap_t,
                                                      int max_side) = 0;

    /// Why the last lookup of this thread failed, on one line.
    virtual std::string lookup_error() const = 0;

    /// What the files opened so far come to when they are read whole, smaller levels included, each
    /// once per decoding; bytes. The cache holds less where its memory is less.
    virtual size_t whole_bytes() const = 0;

    /// Another size for the cache, at any time; what it has too much is given up by and by.
    /// Thread-safe.
    virtual void set_memory(size_t bytes) = 0;

    /// Gives up all tiles, which are read again when they are looked up. Needs all lookups at rest.
    virtual void drop_tiles() = 0;
};

class TextureSourceFactory {
  public:
    virtual ~TextureSourceFactory() = default;

    /// Does not throw. `decoding`: of every image that the plugin opens from here on. Errors:
    /// "textures".
    virtual Result<std::unique_ptr<TextureSource>> make(size_t memory_bytes,
                                                        const DecodeLimits& decoding) const = 0;
};

/// The plugin's; opens it when first called. Thread-safe. Errors: those of plugin::open_needed, the
/// same at every call.
Result<const TextureSourceFactory*> texture_source_factory();

}  // namespace velatura::shading
