// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"
#include "scene/ray_kinds.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace velatura::scene {

/// What lights can tell geometry apart by: pieces of one class are in the same sets. Class 0 is
/// that of geometry of which nobody said anything.
using LinkClass = uint32_t;
using LinkSetId = uint32_t;  ///< index into Linking::sets; none = all geometry

/// Some of the geometry, by its classes.
class LinkSet {
  public:
    LinkSet() = default;

    /// Without any class, for `classes` of them.
    explicit LinkSet(size_t classes) : words_((classes + 63) / 64, 0) {}

    void add(LinkClass c) {
        words_[c / 64] |= uint64_t(1) << (c % 64);
        folded_ |= folded_bit(c);
    }

    bool holds(LinkClass c) const { return (words_[c / 64] >> (c % 64) & 1) != 0; }

    /// No class at all.
    bool is_empty() const { return folded_ == 0; }

    /// folded_bit() of every class in it: no common bit with that of something says that it does
    /// not hold it.
    uint32_t folded() const { return folded_; }

    static uint32_t folded_bit(LinkClass c) { return uint32_t(1) << (c % 32); }

    friend bool operator==(const LinkSet&, const LinkSet&) = default;

  private:
    std::vector<uint64_t> words_;  // bit c % 64 of word c / 64
    uint32_t folded_ = 0;
};

/// What a light shines on and what casts its shadows. UsdLuxLightAPI's collections and
/// UsdLuxShadowAPI.
struct LightLinks {
    LinkSetId lit = none;      ///< what scatters its light; none = everything
    LinkSetId casters = none;  ///< what casts its shadows; none = everything
    /// How far what casts a shadow may be from what lies in it [scene units]; over the last
    /// `shadow_falloff` of that the shadow fades, with the rest of the way to the power of
    /// `shadow_falloff_gamma`.
    float shadow_distance = std::numeric_limits<float>::infinity();
    float shadow_falloff = 0.0f;
    float shadow_falloff_gamma = 1.0f;
    Rgb shadow_color = Rgb(0.0f);  ///< how much of its light arrives in full shadow

    /// Whether its shadows are not those that geometry casts by itself.
    bool has_custom_shadows() const {
        return casters != none || shadow_distance < std::numeric_limits<float>::infinity() ||
               !is_black(shadow_color);
    }

    friend bool operator==(const LightLinks&, const LightLinks&) = default;
};

/// How geometry falls into sets that lights, and rays of a kind, refer to.
struct Linking {
    size_t class_count = 1;
    std::vector<LinkSet> sets;
    std::vector<std::vector<LinkClass>>
        rows;  ///< of Instance::link_row: [row][shape of the prototype]
    /// [RayKind] what rays of the kind meet; none = everything. Where it is less for any kind but
    /// Camera, that of Shadow is a set, if of all geometry: a path then looks for lights behind
    /// what only its own rays meet.
    std::array<LinkSetId, ray_kind_count> visible = {none, none, none, none, none, none, none};
    LinkSetId mattes = none;  ///< held out of the image; none = nothing
    /// Stands for what a plate shows: not in the image, but its light is, with and without
    /// everything else; none = nothing.
    LinkSetId catchers = none;

    LinkSetId visible_to(RayKind kind) const { return visible[size_t(kind)]; }

    bool has_ray_visibility() const {
        for (const LinkSetId set : visible)
            if (set != none) return true;
        return false;
    }
};

}  // namespace velatura::scene
