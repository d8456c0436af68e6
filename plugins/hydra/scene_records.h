// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/authored_prim.h"
#include "usd/layer/layer_builder.h"

#include <pxr/base/gf/matrix4d.h>
#include <pxr/base/tf/token.h>
#include <pxr/base/vt/array.h>
#include <pxr/base/vt/types.h>
#include <pxr/usd/sdf/path.h>

#include <map>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::hydra {

/// Categories that a light refers to; empty: everything.
struct LightLinkNames {
    PXR_NS::TfToken light, shadow;
};

/// A mesh, curves, points, a quadric or a volume.
struct GeometryRecord {
    AuthoredPrim prim;
    PXR_NS::GfMatrix4d transform = PXR_NS::GfMatrix4d(1.0);
    PXR_NS::SdfPath instancer;            ///< empty: placed directly
    PXR_NS::VtIntArray instance_indices;  ///< into the primvars of the instancer
    PXR_NS::TfToken render_tag;
    PXR_NS::VtTokenArray categories;  ///< links of lights that it is in
    LightLinkNames links;             ///< of geometry that is a light
    bool is_visible = true;
    int prim_id = -1;
};

struct LightRecord {
    AuthoredPrim prim;
    LightLinkNames links;
};

/// A point instancer, or native instances, whose places are matrices.
struct InstancerRecord {
    PXR_NS::GfMatrix4d transform = PXR_NS::GfMatrix4d(1.0);
    PXR_NS::SdfPath parent;               ///< instancer that it is a prototype of; may be empty
    PXR_NS::VtIntArray instance_indices;  ///< into the primvars of the parent
    PXR_NS::VtMatrix4dArray matrices;
    PXR_NS::VtVec3fArray translations, scales;
    PXR_NS::VtValue rotations;                     ///< array of quath or quatf
    std::vector<PXR_NS::VtTokenArray> categories;  ///< [instance]; may be empty
    /// Primvars with a value for each instance.
    std::vector<std::pair<std::string, TypedValue>> primvars;
};

/// Where what Hydra knows is in a layer.
struct LayerPlaces {
    std::unordered_map<std::string, int> prim_ids;  ///< Hydra's, by path in the layer
};

/// What Hydra has told of the scene, prim by prim. Thread-safe: prims are synchronized in parallel.
class SceneRecords {
  public:
    void set_geometry(const PXR_NS::SdfPath& id, GeometryRecord record);
    void set_light(const PXR_NS::SdfPath& id, LightRecord record);
    void set_instancer(const PXR_NS::SdfPath& id, InstancerRecord record);

    /// Materials, fields of volumes.
    void set_other(const PXR_NS::SdfPath& id, AuthoredPrim prim);
    void remove(const PXR_NS::SdfPath& id);

    /// Counts changes.
    int version() const;

    /// Writes everything into a layer.
    /// Args: render_tags: only geometry with one of them; empty: all.
    LayerPlaces author(usd::layer::LayerBuilder& builder,
                       const PXR_NS::TfTokenVector& render_tags) const;

  private:
    mutable std::mutex mutex_;
    int version_ = 0;
    std::map<PXR_NS::SdfPath, GeometryRecord> geometry_;
    std::map<PXR_NS::SdfPath, LightRecord> lights_;
    std::map<PXR_NS::SdfPath, InstancerRecord> instancers_;
    std::map<PXR_NS::SdfPath, AuthoredPrim> others_;
};

}  // namespace velatura::hydra
