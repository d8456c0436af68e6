// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "base/source_loc.h"
#include "usd/compose/composition_error.h"
#include "usd/compose/options.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"
#include "usd/layer/types.h"
#include "usd/layer/value.h"
#include "usd/stage/time_code.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

class Layer;

}  // namespace velatura::usd::layer

namespace velatura::usd::stage {

struct PrimData;
class StageImpl;
class Prim;
class Attribute;
class Relationship;

/// How a Stage is opened.
struct StageOptions {
    compose::ComposeOptions compose;  ///< search paths, payload policy, variant fallbacks, limits
    std::vector<std::string> session_layers;  ///< files of session layers, the strongest first
    /// An anonymous layer in memory that is stronger than the session layers; may be null. Its
    /// prims are composed when the stage is opened; properties of these prims can be added until
    /// other threads read the stage.
    std::shared_ptr<layer::Layer> made_layer = nullptr;
};

/// A composed scene (Pixar: UsdStage). Copies are cheap and share one scene; immutable after open()
/// and safe to read from many threads.
/// Ref: AOUSD Core Specification 1.0.1, §11 (stage population) and §12 (value resolution).
class Stage {
  public:
    /// Opens and composes a root layer (.usda, .usdc, .usd, .usdz, .mtlx).
    /// Args:   diagnostics: receives errors of composition, which costs the prim or the arc only;
    ///         must outlive the stage.
    /// Errors: those of reading the root layer.
    static Result<Stage> open(const std::string& path,
                              const StageOptions& options,
                              Diagnostics& diagnostics);

    // Prims

    /// The root of all prims, "/".
    Prim pseudo_root() const;

    /// Prim at an absolute path ("/World/Cam"), also below instances; invalid when there is none.
    Prim prim_at(const layer::Path& path) const;
    Prim prim_at(std::string_view path) const;

    /// Prim of the root layer's defaultPrim; invalid when there is none.
    Prim default_prim() const;

    /// One instance of every prototype, in traversal order: its children represent those of all
    /// instances of the prototype.
    std::vector<Prim> prototypes() const;

    /// Number of prims composed so far; instance proxies count once they were visited.
    size_t prim_count() const;

    // Metadata of the stage: the session layers', then the root layer's, as in OpenUSD

    /// nullopt: not authored.
    std::optional<layer::Value> metadata(std::string_view key) const;

    /// Authored keys of the root layer stack, sorted.
    std::vector<std::string> metadata_keys() const;

    std::string up_axis() const;           ///< "Y" or "Z"; fallback "Y"
    double meters_per_unit() const;        ///< [m per scene unit]; fallback 0.01
    double time_codes_per_second() const;  ///< [1/s]; fallback framesPerSecond, then 24
    double frames_per_second() const;      ///< [1/s]; fallback 24
    double start_time_code() const;        ///< fallback 0
    double end_time_code() const;          ///< fallback 0
    bool has_time_code_range() const;      ///< one layer authors both ends, as in OpenUSD

    // Layers and errors

    /// Identifier of the root layer: its file name.
    std::string root_file() const;

    /// Every layer file that was opened, in this order.
    std::vector<std::string> layer_files() const;

    /// Identifier of the root layer within a package (.usdz); empty when the file is no package.
    std::string package_root_layer(const std::string& package) const;

    /// The collector that open() was given.
    Diagnostics& diagnostics() const;

    /// Composition errors of the prims composed so far, in order of occurrence.
    std::vector<compose::CompositionError> composition_errors() const;

    /// Implementation, for the files of this tier.
    const StageImpl& impl() const { return *impl_; }

  private:
    explicit Stage(std::shared_ptr<StageImpl> impl);
    std::shared_ptr<StageImpl> impl_;
};

/// Handle of a composed prim (Pixar: UsdPrim): one pointer, valid while its Stage lives.
class Prim {
  public:
    /// An invalid prim.
    Prim() = default;

    explicit Prim(const PrimData* data) : data_(data) {}

    bool is_valid() const { return data_ != nullptr; }

    explicit operator bool() const { return is_valid(); }

    bool operator==(const Prim& o) const { return data_ == o.data_; }

    // Identity and type

    const layer::Path& path() const;     ///< absolute path in the stage
    std::string path_string() const;     ///< the same as text
    layer::Token name() const;           ///< last element of the path
    layer::Token type_name() const;      ///< "Mesh"; empty for an untyped prim
    layer::Specifier specifier() const;  ///< composed: Def, Over or Class
    std::string kind() const;            ///< "component" …; empty when not authored

    /// True when the type is `type` or derives from it ("Gprim", "Imageable", "Xformable",
    /// "PointBased", …).
    bool is_a(std::string_view type) const;

    /// apiSchemas as authored, list-op composed.
    std::vector<layer::Token> applied_schemas() const;

    /// True when the API schema is applied; "CollectionAPI" also matches "CollectionAPI:name".
    bool has_api(std::string_view schema) const;

    // Flags, as in UsdPrim

    bool is_pseudo_root() const;
    bool is_active() const;          ///< metadata `active` of the prim itself
    bool is_defined() const;         ///< it and all ancestors have a def or class
    bool is_abstract() const;        ///< it or an ancestor is a class
    bool is_loaded() const;          ///< it and all ancestors have their payloads loaded, or none
    bool is_model() const;           ///< the kind hierarchy from the root is unbroken
    bool is_instanceable() const;    ///< the metadata, whether or not it has an effect
    bool is_instance() const;        ///< its children are those of a prototype, shared by instances
    bool is_instance_proxy() const;  ///< lies below an instance

    // Namespace

    Prim parent() const;

    /// Children that a renderer traverses: active, loaded, defined, not abstract, in composed
    /// order. Those of an instance are instance proxies.
    std::vector<Prim> children() const;

    /// All children, with inactive ones, overs and classes.
    std::vector<Prim> all_children() const;

    /// Child of this name; invalid when there is none.
    Prim child(std::string_view name) const;

    /// Of an instance: the representative instance of its prototype (possibly itself), whose
    /// subtree has the same composed values; two instances share a prototype iff this is the same
    /// prim. Invalid for non-instances.
    Prim prototype() const;

    // Properties and metadata

    /// Names of authored properties, sorted.
    std::vector<layer::Token> property_names() const;

    /// Handle by name; invalid when it is neither authored nor in the schema.
    Attribute attribute(std::string_view name) const;

    /// Handle by name; invalid when it is not authored.
    Relationship relationship(std::string_view name) const;

    /// Composed metadata: the strongest opinion; list-ops composed, dictionaries merged. nullopt:
    /// not authored.
    std::optional<layer::Value> metadata(std::string_view key) const;

    /// Authored keys, sorted, without those of composition arcs.
    std::vector<std::string> metadata_keys() const;

    /// Variant set → selection ("" = none), in composed order of the sets.
    std::vector<std::pair<std::string, std::string>> variant_selections() const;

    // Provenance

    /// A spec that contributes to a prim.
    struct SpecSite {
        std::string layer;  ///< identifier of the layer
        std::string path;   ///< path of the spec in the layer
        SourceLoc loc;      ///< file, line and column
    };

    /// Specs that contribute, strongest first.
    std::vector<SpecSite> prim_stack() const;

    SourceLoc loc() const;             ///< of the strongest spec
    Diagnostics& diagnostics() const;  ///< of the stage

    /// Implementation, for the files of this tier.
    const PrimData* data() const { return data_; }

  private:
    const PrimData* data_ = nullptr;
};

/// Source of an attribute's resolved value (Pixar: UsdResolveInfoSource).
enum class ValueSource : uint8_t { None, Fallback, Default, TimeSamples, Spline, Clips, Blocked };

/// Handle of an attribute by name (Pixar: UsdAttribute). Without an authored spec only the schema
/// fallback has a value.
class Attribute {
  public:
    /// An invalid attribute.
    Attribute() = default;

    Attribute(Prim prim, layer::Token attribute_name) : prim_(prim), name_(attribute_name) {}

    /// True when a spec is authored or the schema declares the attribute.
    bool is_valid() const;

    explicit operator bool() const { return is_valid(); }

    // Identity and type

    Prim prim() const { return prim_; }

    layer::Token name() const { return name_; }

    std::string path_string() const;
    layer::Token type_name() const;  ///< "float3[]"; of the schema, else of the strongest spec
    bool is_authored() const;        ///< some layer has a spec for it
    bool is_custom() const;          ///< authored `custom`
    bool is_uniform() const;         ///< variability `uniform`

    // Value resolution. time: of the stage; the default TimeCode reads default values

    /// Where value() comes from.
    ValueSource value_source() const;

    /// True for an authored default, samples, spline or clips that are not blocked.
    bool has_authored_value() const;

    /// Resolved value, interpolated between samples. Empty: there is none, or it is blocked.
    layer::Value value(TimeCode time = {}) const;

    /// Resolved value as T: exact type first, else a lossless-in-kind conversion (half, float,
    /// double, int of the same shape; string, token, asset; arrays element-wise). T: bool, int,
    /// int64_t, float, double, std::string, Token, AssetPath, Vec2f … Vec4f, Vec2d … Vec4d, Vec2i …
    /// Vec4i, QuatFloat, QuatDouble, Mat2d … Mat4d of usd/layer/types.h, and std::vector of these.
    /// Returns: nullopt when absent, blocked or of another shape.
    template <class T>
    std::optional<T> get(TimeCode time = {}) const;

    /// get(), or `otherwise` where that is nullopt.
    template <class T>
    T get_or(const T& otherwise, TimeCode time = {}) const {
        auto v = get<T>(time);
        return v ? *std::move(v) : otherwise;
    }

    /// Schema fallback, without authored values.
    std::optional<layer::Value> fallback() const;

    /// Authored default, without samples or fallback; a block counts as a value.
    std::optional<layer::Value> authored_default() const;

    // Time samples

    /// Times of the strongest samples, ascending, in stage time; empty when the value does not come
    /// from samples.
    std::vector<double> time_samples() const;

    /// The sample authored exactly at a time of time_samples(); a block is a block Value.
    layer::Value sample_at(double time) const;

    /// True for more than one sample, or a spline.
    bool might_be_time_varying() const;

    // Connections and assets

    /// Connections, list-op composed and mapped to the stage's namespace.
    std::vector<layer::Path> connections() const;

    bool has_authored_connections() const;

    /// Absolute file name of an asset value: relative to the layer of the strongest opinion, then
    /// by search paths. Empty when there is no value; the anchored path where no such file exists.
    std::string resolved_asset_path(TimeCode time = {}) const;

    /// The same for every element of an asset[] value.
    std::vector<std::string> resolved_asset_paths(TimeCode time = {}) const;

    // Metadata and provenance, as of Prim

    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys() const;

    /// File, line and column of the strongest value opinion; of the strongest spec when there is no
    /// value.
    SourceLoc loc() const;

  private:
    Prim prim_;
    layer::Token name_;
};

/// Handle of a relationship by name (Pixar: UsdRelationship).
class Relationship {
  public:
    /// An invalid relationship.
    Relationship() = default;

    Relationship(Prim prim, layer::Token relationship_name)
        : prim_(prim), name_(relationship_name) {}

    /// True when some layer has a spec for it.
    bool is_valid() const;

    explicit operator bool() const { return is_valid(); }

    // Identity

    Prim prim() const { return prim_; }

    layer::Token name() const { return name_; }

    std::string path_string() const;
    bool is_custom() const;  ///< authored `custom`

    // Targets

    bool has_authored_targets() const;

    /// Targets, list-op composed and mapped to the stage's namespace.
    std::vector<layer::Path> targets() const;

    /// Targets with targeted relationships replaced by their own targets; cycles are cut.
    std::vector<layer::Path> forwarded_targets() const;

    // Metadata and provenance, as of Prim

    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys() const;
    SourceLoc loc() const;  ///< of the strongest targets; of the prim when there are none

  private:
    Prim prim_;
    layer::Token name_;
};

/// Calls visit for `root` and its descendants (children() order, parents first); return false to
/// skip the subtree.
void traverse(Prim root, const std::function<bool(Prim)>& visit);

}  // namespace velatura::usd::stage
