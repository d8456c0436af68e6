// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "usd/layer/path.h"

#include <optional>
#include <unordered_map>

namespace velatura::translate::linking {

/// What a prim, or those above it, author of the kinds of rays that see it, and whether it is a
/// matte (docs/reference/visibility.md).
struct VisibilityOpinion {
    scene::RayKinds stated;   ///< kinds that something is authored of
    scene::RayKinds visible;  ///< of these
    std::optional<bool> is_matte, is_catcher;

    bool is_empty() const { return stated.is_empty() && !is_matte && !is_catcher; }

    /// Adds what is inherited from further above.
    void inherit(const VisibilityOpinion& above);

    /// Kinds of rays that see the prim.
    scene::RayKinds kinds() const { return visible | ~stated; }
};

/// State of this module: the opinions of prims, where they were read.
struct AuthoredVisibility {
    std::unordered_map<usd::layer::Path, VisibilityOpinion> of_prim;

    /// Of a prim and those above it, up to and including `last`, if that is above.
    VisibilityOpinion above(usd::layer::Path path, usd::layer::Path last = {}) const;
};

/// Notes what the prim authors, so that places of instances are kept; before what it places.
/// Returns: whether something of it is to be rendered.
bool note_visibility(Context& ctx, Prim prim);

/// Whether the camera sees the light, by what is inherited and by attributes of lights.
bool is_light_seen(Context& ctx, Prim light, const VisibilityOpinion& inherited);

}  // namespace velatura::translate::linking
