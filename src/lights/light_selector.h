// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_set.h"
#include "scene/linking.h"

#include <cstdint>
#include <memory>
#include <optional>

namespace velatura::lights {

enum class SelectionKind : uint8_t {
    Uniform,
    Power,
    Tree,
    /// By area: with points by area, uniform over the surface of all lights. Lights at infinity,
    /// which have none, share what uniform selection would give them.
    Area,
};

struct SelectorOptions {
    SelectionKind kind = SelectionKind::Tree;
    double uniform_part = 0.1;  ///< of Power: share of the choices made uniformly, in (0, 1]
};

/// Where light is wanted.
struct Receiver {
    Vec3 p;               ///< render space
    Vec3 n = Vec3(0.0f);  ///< unit normal on the side of the viewer; zero = every direction counts
    bool both_sides = true;     ///< light from behind n counts too
    scene::LinkClass link = 0;  ///< of the surface there
    float time = 0;             ///< of the path
};

/// A chosen light and the probability of that choice.
struct LightChoice {
    LightId light;
    float pmf = 0;
};

/// Chooses one light per vertex: a light of the scene or an emissive triangle. Lights that are off
/// have probability zero; so may lights that cannot reach the receiver or are not linked to it.
class LightSelector {
  public:
    virtual ~LightSelector() = default;

    /// No light is on.
    virtual bool is_empty() const = 0;

    /// select() asks nothing of the number: it gives one light at most, whatever it is.
    virtual bool is_single() const { return false; }

    /// Chooses by u in [0,1); nothing when no light reaches the receiver. Bits of u below 2^-32
    /// matter among very many lights only, see wants_fine_numbers().
    virtual std::optional<LightChoice> select(const Receiver& at, double u) const = 0;

    /// The probability with which select() chooses the light there: the same number, bit for bit.
    virtual float pmf(const Receiver& at, LightId light) const = 0;
};

/// Args: scene_bounds in render space: what lights at infinity shine on; may be empty.
std::unique_ptr<LightSelector> make_light_selector(const LightSet& lights,
                                                   const Box3& scene_bounds,
                                                   const SelectorOptions& options = {});

/// Whether 32 bits of a random number are too few to choose one of so many lights: then its
/// choices differ from its probabilities.
bool wants_fine_numbers(const LightSet& lights);

}  // namespace velatura::lights
