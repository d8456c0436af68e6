// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/geometry_prim.h"

#include "plugins/hydra/light_inputs.h"

#include <pxr/imaging/hd/basisCurvesTopology.h>
#include <pxr/imaging/hd/changeTracker.h>
#include <pxr/imaging/hd/instancer.h>
#include <pxr/imaging/hd/meshTopology.h>
#include <pxr/imaging/hd/renderIndex.h>
#include <pxr/imaging/hd/tokens.h>
#include <pxr/imaging/pxOsd/tokens.h>

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::Token;
using usd::layer::Value;

namespace {

/// Types of USD, with the attributes of those whose shape is a few numbers.
struct GeometryType {
    std::string name;
    std::vector<std::string> attributes;
};

const std::map<TfToken, GeometryType>& type_table() {
    static const std::map<TfToken, GeometryType> table = {
        {HdPrimTypeTokens->mesh, {"Mesh", {}}},
        {HdPrimTypeTokens->basisCurves, {"BasisCurves", {}}},
        {HdPrimTypeTokens->points, {"Points", {}}},
        {HdPrimTypeTokens->volume, {"Volume", {}}},
        {HdPrimTypeTokens->sphere, {"Sphere", {"radius"}}},
        {HdPrimTypeTokens->cube, {"Cube", {"size"}}},
        {HdPrimTypeTokens->cone, {"Cone", {"height", "radius", "axis"}}},
        {HdPrimTypeTokens->cylinder, {"Cylinder", {"height", "radius", "axis"}}},
        {HdPrimTypeTokens->capsule, {"Capsule", {"height", "radius", "axis"}}},
    };
    return table;
}

constexpr std::array interpolations = {
    std::pair(HdInterpolationConstant, "constant"), std::pair(HdInterpolationUniform, "uniform"),
    std::pair(HdInterpolationVarying, "varying"), std::pair(HdInterpolationVertex, "vertex"),
    std::pair(HdInterpolationFaceVarying, "faceVarying")};

std::vector<int32_t> numbers(const VtIntArray& array) {
    return {array.begin(), array.end()};
}

void bind_material(AuthoredPrim& prim, const SdfPath& material) {
    if (material.IsEmpty()) return;
    prim.apply_schema("MaterialBindingAPI");
    prim.target("material:binding", {to_path(material)});
}

}  // namespace

const TfTokenVector& geometry_types() {
    static const TfTokenVector types = [] {
        TfTokenVector all;
        for (const auto& [type, name] : type_table()) all.push_back(type);
        return all;
    }();
    return types;
}

GeometryPrim::GeometryPrim(const TfToken& type, const SdfPath& id, SceneRecords& records)
    : HdRprim(id), type_(type), records_(records) {}

HdDirtyBits GeometryPrim::GetInitialDirtyBitsMask() const {
    return HdChangeTracker::AllSceneDirtyBits | HdChangeTracker::InitRepr;
}

/// Everything is authored anew: what is asked for must be at hand.
HdDirtyBits GeometryPrim::_PropagateDirtyBits(HdDirtyBits bits) const {
    return (bits & HdChangeTracker::AllSceneDirtyBits) != 0
               ? bits | (HdChangeTracker::AllSceneDirtyBits & ~HdChangeTracker::Varying)
               : bits;
}

void GeometryPrim::_InitRepr(const TfToken& repr, HdDirtyBits* dirty_bits) {
    (void)dirty_bits;
    for (const auto& [token, draw_items] : _reprs)
        if (token == repr) return;
    _reprs.emplace_back(repr, HdReprSharedPtr());
}

const TfTokenVector& GeometryPrim::GetBuiltinPrimvarNames() const {
    static const TfTokenVector names = {HdTokens->points, HdTokens->normals, HdTokens->widths};
    return names;
}

void GeometryPrim::Sync(HdSceneDelegate* delegate,
                        HdRenderParam* param,
                        HdDirtyBits* dirty_bits,
                        const TfToken& repr) {
    (void)param, (void)repr;
    const SdfPath& id = GetId();
    _UpdateInstancer(delegate, dirty_bits);
    if (!GetInstancerId().IsEmpty())
        HdInstancer::_SyncInstancerAndParents(delegate->GetRenderIndex(), GetInstancerId());
    SetMaterialId(delegate->GetMaterialId(id));
    GeometryRecord record;
    record.prim = author(*delegate);
    if (is_light(*delegate)) {
        record.prim.apply_schema("MeshLightAPI");
        author_light(*delegate, id, record.prim);
        record.prim.set("light:materialSyncMode",
                        delegate->GetLightParamValue(id, HdTokens->materialSyncMode));
        record.links = read_links(*delegate, id);
    }
    record.transform = delegate->GetTransform(id);
    record.instancer = GetInstancerId();
    if (!record.instancer.IsEmpty())
        record.instance_indices = delegate->GetInstanceIndices(record.instancer, id);
    record.render_tag = delegate->GetRenderTag(id);
    record.categories = delegate->GetCategories(id);
    record.is_visible = delegate->GetVisible(id);
    record.prim_id = GetPrimId();
    _sharedData.visible = record.is_visible;
    records_.set_geometry(id, std::move(record));
    *dirty_bits &= ~HdDirtyBits(HdChangeTracker::AllSceneDirtyBits);
}

bool GeometryPrim::is_light(HdSceneDelegate& delegate) const {
    return type_ == HdPrimTypeTokens->mesh &&
           delegate.GetLightParamValue(GetId(), HdTokens->isLight).GetWithDefault(false);
}

void GeometryPrim::Finalize(HdRenderParam* param) {
    records_.remove(GetId());
    HdRprim::Finalize(param);
}

AuthoredPrim GeometryPrim::author(HdSceneDelegate& delegate) const {
    const GeometryType& type = type_table().at(type_);
    AuthoredPrim prim(type.name);
    for (const std::string& name : type.attributes)
        prim.set(name, delegate.Get(GetId(), TfToken(name)));
    prim.set("doubleSided", "bool", Value(delegate.GetDoubleSided(GetId())));
    if (type_ == HdPrimTypeTokens->mesh) author_mesh(delegate, prim);
    if (type_ == HdPrimTypeTokens->basisCurves) author_curves(delegate, prim);
    if (type_ == HdPrimTypeTokens->volume) author_volume(delegate, prim);
    author_primvars(delegate, prim);
    bind_material(prim, GetMaterialId());
    return prim;
}

void GeometryPrim::author_mesh(HdSceneDelegate& delegate, AuthoredPrim& prim) const {
    const HdMeshTopology topology = delegate.GetMeshTopology(GetId());
    prim.set("faceVertexCounts", VtValue(topology.GetFaceVertexCounts()));
    prim.set("faceVertexIndices", VtValue(topology.GetFaceVertexIndices()));
    prim.set("holeIndices", VtValue(topology.GetHoleIndices()));
    prim.set("subdivisionScheme", VtValue(topology.GetScheme()));
    prim.set("orientation", VtValue(topology.GetOrientation()));
    const PxOsdSubdivTags tags = delegate.GetSubdivTags(GetId());
    const auto set_rule = [&prim](const char* name, const TfToken& rule) {
        if (!rule.IsEmpty()) prim.set(name, VtValue(rule));
    };
    set_rule("interpolateBoundary", tags.GetVertexInterpolationRule());
    set_rule("faceVaryingLinearInterpolation", tags.GetFaceVaryingInterpolationRule());
    set_rule("triangleSubdivisionRule", tags.GetTriangleSubdivision());
    prim.set("creaseIndices", VtValue(tags.GetCreaseIndices()));
    prim.set("creaseLengths", VtValue(tags.GetCreaseLengths()));
    prim.set("creaseSharpnesses", VtValue(tags.GetCreaseWeights()));
    prim.set("cornerIndices", VtValue(tags.GetCornerIndices()));
    prim.set("cornerSharpnesses", VtValue(tags.GetCornerWeights()));
    int number = 0;
    for (const HdGeomSubset& subset : topology.GetGeomSubsets()) {
        std::string name = to_path(subset.id).name().str();
        if (name.empty()) name = "Subset_" + std::to_string(number);
        ++number;
        AuthoredPrim& child = prim.add_child(name, "GeomSubset");
        child.set_token("elementType", "face");
        child.set_token("familyName", "materialBind");
        child.set("indices", VtValue(subset.indices));
        bind_material(child, subset.materialId);
    }
}

void GeometryPrim::author_curves(HdSceneDelegate& delegate, AuthoredPrim& prim) const {
    const HdBasisCurvesTopology topology = delegate.GetBasisCurvesTopology(GetId());
    if (topology.HasIndices())
        TF_WARN("velatura: the vertex indices of curves <%s> are ignored", GetId().GetText());
    prim.set("curveVertexCounts", VtValue(topology.GetCurveVertexCounts()));
    prim.set("type", VtValue(topology.GetCurveType()));
    if (!topology.GetCurveBasis().IsEmpty()) prim.set("basis", VtValue(topology.GetCurveBasis()));
    prim.set("wrap", VtValue(topology.GetCurveWrap()));
}

void GeometryPrim::author_volume(HdSceneDelegate& delegate, AuthoredPrim& prim) const {
    for (const HdVolumeFieldDescriptor& field : delegate.GetVolumeFieldDescriptors(GetId()))
        prim.target("field:" + field.fieldName.GetString(), {to_path(field.fieldId)});
}

void GeometryPrim::author_primvars(HdSceneDelegate& delegate, AuthoredPrim& prim) const {
    const SdfPath& id = GetId();
    for (const auto& [interpolation, name] : interpolations) {
        for (const HdPrimvarDescriptor& primvar :
             delegate.GetPrimvarDescriptors(id, interpolation)) {
            VtIntArray indices;
            const VtValue value = primvar.indexed
                                      ? delegate.GetIndexedPrimvar(id, primvar.name, &indices)
                                      : delegate.Get(id, primvar.name);
            std::optional<TypedValue> typed = to_value(value, primvar.role);
            if (!typed) continue;
            const bool is_plain = primvar.name == HdTokens->points ||
                                  primvar.name == HdTokens->widths ||
                                  (primvar.name == HdTokens->normals && indices.empty());
            const std::string attribute = (is_plain ? "" : "primvars:") + primvar.name.GetString();
            prim.set_interpolated(attribute, *std::move(typed), name, numbers(indices));
        }
    }
}

}  // namespace velatura::hydra
