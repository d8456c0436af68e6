// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace velatura::scene {

/// What a ray is for. Geometry may be invisible to rays of some kinds.
enum class RayKind : uint8_t {
    Camera,               ///< from the camera up to the first scattering event
    Shadow,               ///< between a scattering event and a light
    Diffuse,              ///< reflected by a diffuse lobe
    DiffuseTransmission,  ///< through a thin wall by a diffuse lobe
    Reflection,           ///< by a specular lobe, of whatever roughness
    Refraction,           ///< the same to the other side; also straight through clear surfaces
    Volume                ///< scattered by a participating medium
};

inline constexpr size_t ray_kind_count = 7;

/// A set of kinds.
class RayKinds {
  public:
    constexpr RayKinds() = default;

    static constexpr RayKinds all() { return RayKinds((1u << ray_kind_count) - 1); }

    constexpr bool has(RayKind kind) const { return (bits_ >> unsigned(kind) & 1) != 0; }

    constexpr RayKinds with(RayKind kind) const { return RayKinds(bits_ | 1u << unsigned(kind)); }

    constexpr bool is_empty() const { return bits_ == 0; }

    constexpr RayKinds operator|(RayKinds o) const { return RayKinds(bits_ | o.bits_); }

    constexpr RayKinds operator&(RayKinds o) const { return RayKinds(bits_ & o.bits_); }

    constexpr RayKinds operator~() const { return RayKinds(~unsigned(bits_) & all().bits_); }

    constexpr auto operator<=>(const RayKinds&) const = default;

  private:
    constexpr explicit RayKinds(unsigned bits) : bits_(uint8_t(bits)) {}

    uint8_t bits_ = 0;
};

}  // namespace velatura::scene
