// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/matte_kind.h"
#include "base/result.h"
#include "image/image.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::layers {

/// MurmurHash3_x86_32 of the bytes.
/// Ref: Appleby, "MurmurHash3", 2011 (public domain).
uint32_t murmur_hash_3(std::string_view text, uint32_t seed = 0);

/// The bits of the float that stands for a name in Cryptomatte: its hash, with the exponent kept
/// off 0 and 255, so that it is a normal number. Never 0, which means nothing.
/// Ref: Friedman & Jones, "Cryptomatte Specification" 1.2, "Floating point conversion".
uint32_t matte_id(std::string_view name);

/// One thing that a Cryptomatte tells apart.
struct MatteName {
    std::string name;
    uint32_t id = 0;  ///< bits of the float in the pixels

    bool operator==(const MatteName&) const = default;
};

/// A Cryptomatte as the header of a file describes it.
struct Cryptomatte {
    std::string layer;             ///< "CryptoObject"; the channels are CryptoObject00.R …
    std::vector<MatteName> names;  ///< its manifest, by name; may be empty
    std::string fault = {};        ///< of the manifest, where it is missing or not as it should be
};

/// Sets the strings cryptomatte/<key>/name, hash, conversion and manifest. Bytes that are no UTF-8
/// become U+FFFD.
void describe_cryptomatte(const Cryptomatte& matte, image::Attributes& attributes);

/// Those that the header describes, by layer. Of an image without pixels as well. A manifest in a
/// file beside the image (manif_file) is read where `path`, that of the image, is given.
std::vector<Cryptomatte> cryptomattes_of(const image::Image& image, const std::string& path = "");

/// The one over a layer; `name` may be "object" or "material" for short, or its last word in any
/// case, without `_`. Errors: "matte-layer" (the message lists those there are).
Result<const Cryptomatte*> find_matte(std::span<const Cryptomatte> mattes, std::string_view name);

/// The ids that the patterns choose: a name as it stands, a name with * (any text) or ? (any
/// character; \* and \? are these themselves), or a prim path, which stands for all below it as
/// well. A text without * and ? that the manifest does not have counts by its hash if there is no
/// manifest.
/// Errors: "matte-name" (a pattern chooses nothing; the message names the most similar names).
Result<std::vector<uint32_t>> matte_ids(const Cryptomatte& matte,
                                        std::span<const std::string> patterns);

/// "matte-layer": why the ids of a layer cannot be had, of an image without pixels as well.
Error no_ids(const image::Image& image, std::string_view layer);

/// Ranked pairs of id and coverage over an image: the bits of the floats are the ids, 0 = nothing.
struct MatteRank {
    const std::vector<float>* ids = nullptr;
    const std::vector<float>* coverage = nullptr;
};

/// Those that the image has of a layer, the greatest coverage first. Errors: that of no_ids.
Result<std::vector<MatteRank>> matte_ranks(const image::Image& image, std::string_view layer);

/// What a layer is called whatever the renderer: `View Layer.CryptoObject` and `crypto_object` →
/// `cryptoobject`.
std::string plain_matte_name(std::string_view layer);

/// How much of each pixel the ids cover, in [0, 1] by filters without negative lobes: [height]
/// [width], row 0 = top. The image needs the channels layer00.R … alone.
/// Errors: that of no_ids.
Result<std::vector<float>> matte_coverage(const image::Image& image,
                                          std::string_view layer,
                                          std::span<const uint32_t> ids);

}  // namespace velatura::layers
