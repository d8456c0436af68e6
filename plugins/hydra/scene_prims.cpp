// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/scene_prims.h"

#include "plugins/hydra/light_inputs.h"

#include <pxr/imaging/hd/changeTracker.h>
#include <pxr/imaging/hd/sceneDelegate.h>
#include <pxr/imaging/hd/tokens.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::Path;
using usd::layer::Token;
using usd::layer::Value;

namespace {

const std::map<TfToken, std::string>& light_table() {
    static const std::map<TfToken, std::string> table = {
        {HdPrimTypeTokens->cylinderLight, "CylinderLight"},
        {HdPrimTypeTokens->diskLight, "DiskLight"},
        {HdPrimTypeTokens->distantLight, "DistantLight"},
        {HdPrimTypeTokens->domeLight, "DomeLight"},
        {HdPrimTypeTokens->rectLight, "RectLight"},
        {HdPrimTypeTokens->sphereLight, "SphereLight"},
    };
    return table;
}

/// Name of a node's prim below its material.
std::string node_name(const SdfPath& node, const SdfPath& material) {
    const SdfPath relative = node.HasPrefix(material) ? node.MakeRelativePath(material) : node;
    std::string name;
    for (const char c : relative.GetString()) name += c == '/' || c == '.' ? '_' : c;
    return to_path(SdfPath("/node_" + name)).name().str();
}

/// Type of an input that takes what an output gives.
std::string connection_type(const HdMaterialNetwork2& network,
                            const HdMaterialNode2& node,
                            const TfToken& input,
                            const HdMaterialConnection2& source) {
    if (const auto constant = node.parameters.find(input); constant != node.parameters.end())
        if (const std::optional<TypedValue> typed = to_value(constant->second)) return typed->type;
    const std::string& output = source.upstreamOutputName.GetString();
    if (output == "rgb") return "float3";
    if (output == "rgba") return "float4";
    if (output.size() == 1) return "float";
    const auto upstream = network.nodes.find(source.upstreamNode);
    if (upstream == network.nodes.end()) return "token";
    const std::string& id = upstream->second.nodeTypeId.GetString();
    for (const char* const type : {"float2", "float3", "float4", "float", "int", "string"})
        if (id.ends_with(std::string("_") + type)) return type;
    return id == "UsdTransform2d" ? "float2" : "token";
}

void author_node(const SdfPath& material,
                 const HdMaterialNetwork2& network,
                 const HdMaterialNode2& node,
                 AuthoredPrim& shader) {
    shader.set_token("info:id", node.nodeTypeId.GetString());
    for (const auto& [name, value] : node.parameters) {
        const std::string& text = name.GetString();
        constexpr std::string_view color_space = "colorSpace:", type_name = "typeName:";
        if (text.starts_with(type_name)) continue;
        if (text.starts_with(color_space)) {
            if (value.IsHolding<TfToken>() && !value.UncheckedGet<TfToken>().IsEmpty())
                shader.add_metadata("inputs:" + text.substr(color_space.size()), "colorSpace",
                                    Value(Token(value.UncheckedGet<TfToken>().GetString())));
            continue;
        }
        shader.set("inputs:" + text, value);
    }
    for (const auto& [name, sources] : node.inputConnections) {
        if (sources.empty()) continue;
        const HdMaterialConnection2& source = sources.front();
        const Path to = to_path(material)
                            .append_child(node_name(source.upstreamNode, material))
                            .append_property("outputs:" + source.upstreamOutputName.GetString());
        shader.connect("inputs:" + name.GetString(), connection_type(network, node, name, source),
                       to);
    }
}

bool is_materialx(const HdMaterialNetwork2& network, const SdfPath& node) {
    const auto at = network.nodes.find(node);
    return at != network.nodes.end() && at->second.nodeTypeId.GetString().starts_with("ND_");
}

}  // namespace

const TfTokenVector& light_types() {
    static const TfTokenVector types = [] {
        TfTokenVector all;
        for (const auto& [type, name] : light_table()) all.push_back(type);
        return all;
    }();
    return types;
}

void MaterialPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* param, HdDirtyBits* dirty_bits) {
    (void)param;
    AuthoredPrim prim("Material");
    const VtValue resource = delegate->GetMaterialResource(GetId());
    if (resource.IsHolding<HdMaterialNetworkMap>()) {
        const HdMaterialNetwork2 network =
            HdConvertToHdMaterialNetwork2(resource.UncheckedGet<HdMaterialNetworkMap>());
        for (const auto& [path, node] : network.nodes)
            author_node(GetId(), network, node, prim.add_child(node_name(path, GetId()), "Shader"));
        for (const auto& [terminal, source] : network.terminals) {
            const std::string output = source.upstreamOutputName.IsEmpty()
                                           ? terminal.GetString()
                                           : source.upstreamOutputName.GetString();
            const bool is_mtlx = is_materialx(network, source.upstreamNode);
            prim.connect((is_mtlx ? "outputs:mtlx:" : "outputs:") + terminal.GetString(), "token",
                         to_path(GetId())
                             .append_child(node_name(source.upstreamNode, GetId()))
                             .append_property("outputs:" + output));
        }
    }
    records_.set_other(GetId(), std::move(prim));
    *dirty_bits = Clean;
}

void LightPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* param, HdDirtyBits* dirty_bits) {
    (void)param;
    const SdfPath& id = GetId();
    _UpdateInstancer(delegate, dirty_bits);
    if (!GetInstancerId().IsEmpty())
        TF_WARN("velatura: light <%s> is instanced; it is placed once", id.GetText());
    if (!delegate->GetVisible(id)) {
        records_.remove(id);
        *dirty_bits = Clean;
        return;
    }
    LightRecord record;
    record.prim = AuthoredPrim(light_table().at(type_));
    record.prim.set_transform(delegate->GetTransform(id), true);
    author_light(*delegate, id, record.prim);
    record.links = read_links(*delegate, id);
    records_.set_light(id, std::move(record));
    *dirty_bits = Clean;
}

void InstancerPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* param, HdDirtyBits* dirty_bits) {
    (void)param;
    _UpdateInstancer(delegate, dirty_bits);
    const SdfPath& id = GetId();
    record_.transform = delegate->GetInstancerTransform(id);
    record_.parent = GetParentId();
    record_.instance_indices =
        record_.parent.IsEmpty() ? VtIntArray() : delegate->GetInstanceIndices(record_.parent, id);
    record_.categories = delegate->GetInstanceCategories(id);
    // Their descriptors are at hand only then
    if (HdChangeTracker::IsAnyPrimvarDirty(*dirty_bits, id)) read_primvars(*delegate);
    records_.set_instancer(id, record_);
    *dirty_bits = HdChangeTracker::Clean;
}

void InstancerPrim::read_primvars(HdSceneDelegate& delegate) {
    record_.matrices.clear();
    record_.translations.clear();
    record_.scales.clear();
    record_.rotations = VtValue();
    record_.primvars.clear();
    for (const HdPrimvarDescriptor& primvar :
         delegate.GetPrimvarDescriptors(GetId(), HdInterpolationInstance)) {
        const VtValue value = delegate.Get(GetId(), primvar.name);
        if (primvar.name == HdInstancerTokens->instanceTransforms) {
            record_.matrices = value.GetWithDefault<VtMatrix4dArray>();
        } else if (primvar.name == HdInstancerTokens->instanceTranslations) {
            record_.translations = value.GetWithDefault<VtVec3fArray>();
        } else if (primvar.name == HdInstancerTokens->instanceScales) {
            record_.scales = value.GetWithDefault<VtVec3fArray>();
        } else if (primvar.name == HdInstancerTokens->instanceRotations) {
            record_.rotations = value;
        } else if (std::optional<TypedValue> typed = to_value(value, primvar.role)) {
            record_.primvars.emplace_back(primvar.name.GetString(), *std::move(typed));
        }
    }
}

void InstancerPrim::Finalize(HdRenderParam* param) {
    records_.remove(GetId());
    HdInstancer::Finalize(param);
}

void FieldPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* param, HdDirtyBits* dirty_bits) {
    (void)param;
    AuthoredPrim prim("OpenVDBAsset");
    for (const char* const name : {"filePath", "fieldName", "fieldIndex", "fieldClass"}) {
        const VtValue value = delegate->Get(GetId(), TfToken(name));
        const bool is_empty_token =
            value.IsHolding<TfToken>() && value.UncheckedGet<TfToken>().IsEmpty();
        if (!value.IsEmpty() && !is_empty_token) prim.set(name, value);
    }
    records_.set_other(GetId(), std::move(prim));
    *dirty_bits = Clean;
}

}  // namespace velatura::hydra
