// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"
#include "usd/stage/stage.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::usd::stage {

class ClipSet;
using ClipSets = std::vector<std::shared_ptr<const ClipSet>>;

/// One spec that contributes to a prim.
struct SpecRef {
    const layer::Spec* spec = nullptr;
    const compose::StackLayer* layer = nullptr;
    int node = 0;  ///< of the prim's index
};

/// What a Prim handle points to. Immutable once made, but for the children of instances, which come
/// on demand.
struct PrimData {
    StageImpl* stage = nullptr;
    PrimData* parent = nullptr;
    layer::Path path;
    compose::PrimIndex index;
    std::vector<SpecRef> specs;  ///< strongest first
    /// Clip sets that may reach it, nearest prim's first; null where there are none.
    std::shared_ptr<const ClipSets> clips;
    layer::Token type_name;
    layer::Specifier specifier = layer::Specifier::Over;
    bool is_active = true;
    bool is_defined = false;
    bool is_abstract = false;
    bool is_loaded = true;
    bool is_model = false;
    bool is_group = false;
    bool is_instanceable = false;
    bool is_instance = false;
    bool is_instance_proxy = false;
    const PrimData* prototype = nullptr;  ///< representative of an instance's prototype
    std::vector<std::unique_ptr<PrimData>> children;
    std::atomic<bool> expanded{false};
};

/// One property spec that contributes, with what is needed to read its values.
struct PropertySpec {
    const layer::Spec* spec = nullptr;
    const SpecRef* prim_spec = nullptr;
    layer::LayerOffset to_stage;  ///< layer time → stage time
};

/// Time of a layer → time of the stage.
inline layer::LayerOffset offset_to_stage(const compose::Node& node,
                                          const compose::StackLayer& layer) {
    return node.to_root->time_offset().after(layer.to_root);
}

/// Specs of a property, strongest first; only those of one kind (the strongest spec's) count.
std::vector<PropertySpec> property_specs(const PrimData& prim, layer::Token name);

class StageImpl {
  public:
    StageImpl(StageOptions options, Diagnostics& diagnostics);

    Result<bool> open(const std::string& path);

    /// Composes the children of a prim when that has not been done; safe from many threads.
    void ensure_children(const PrimData& prim);
    const PrimData* find(const layer::Path& path);

    const PrimData& root() const { return *root_; }

    const std::vector<const PrimData*>& prototypes() const { return prototypes_; }

    size_t prim_count() const { return prim_count_; }

    compose::Composer& composer() { return composer_; }

    const compose::Composer& composer() const { return composer_; }

    Diagnostics& diagnostics() { return diagnostics_; }

    /// Strongest value of a stage metadatum: session layer, then root layer.
    const layer::Value* root_field(layer::Token name) const;
    const std::vector<const layer::Layer*>& root_layers() const;
    std::string resolve_asset(const std::string& asset, const layer::Layer& layer);
    /// Opens the layer an asset path means, seen from another layer; null with a warning at `loc`
    /// when that fails.
    compose::LayerPtr open_asset_layer(const std::string& asset,
                                       const layer::Layer& from,
                                       const std::string& what,
                                       SourceLoc loc);

  private:
    void populate();
    void expand(PrimData& prim);
    std::unique_ptr<PrimData> make_prim(PrimData* parent, compose::PrimIndex index);
    void read_prim(PrimData& prim);
    void read_clips(PrimData& prim);
    void classify(PrimData& prim);

    StageOptions options_;
    Diagnostics& diagnostics_;
    compose::Composer composer_;
    std::unique_ptr<PrimData> root_;
    std::unordered_map<std::string, const PrimData*> prototype_of_key_;
    std::vector<const PrimData*> prototypes_;
    std::atomic<size_t> prim_count_{0};
    std::mutex mutex_;
};

/// What a value of a layer is on the stage: time codes retimed, path expressions mapped, inside
/// dictionaries too. Ref: AOUSD Core Specification 1.0.1, 7.6.1.2.2.
layer::Value stage_value(const PrimData& prim, const SpecRef& ref, const layer::Value& value);

/// The same without time.
layer::Value with_stage_paths(const PrimData& prim, const SpecRef& ref, const layer::Value& value);

// Metadata of stacked specs, shared by prims and properties

/// Composed value of a field over specs, strongest first: list-ops composed, dictionaries merged,
/// else the strongest.
std::optional<layer::Value> compose_field(const std::vector<const layer::Spec*>& specs,
                                          layer::Token name);

/// The same for values at hand.
std::optional<layer::Value> compose_values(const std::vector<layer::Value>& strongest_first);

/// True for fields that are composition, not metadata.
bool is_composition_field(layer::Token name);
bool is_prim_field(layer::Token name);
bool is_property_field(layer::Token name);

}  // namespace velatura::usd::stage
