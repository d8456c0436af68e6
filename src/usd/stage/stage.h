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

struct StageOptions {
    compose::ComposeOptions compose;  ///< search paths, payload policy, variant fallbacks, limits
    std::vector<std::string> session_layers;  ///< files stronger than the root layer, the
                                              ///< strongest first
    /// A layer in memory above all those; may be null. Prims are composed from what it holds when
    /// the stage is opened; properties of these prims may be added until other threads read.
    std::shared_ptr<layer::Layer> made_layer = nullptr;
};

/// A composed scene. Cheap to copy (copies share one scene), immutable after open, safe to read
/// from many threads. Ref: AOUSD Core Specification 1.0.1, §11 (stage population) and §12 (value
/// resolution).
class Stage {
  public:
    /// Opens and composes a root layer. Errors of the user's data go into `diagnostics`, which must
    /// outlive the stage, and composing goes on; an Error comes back only when the root layer
    /// itself cannot be read.
    static Result<Stage> open(const std::string& path,
                              const StageOptions& options,
                              Diagnostics& diagnostics);

    /// The invisible root of all prims, "/".
    Prim pseudo_root() const;
    /// Prim at an absolute path ("/World/Cam"), also below instances; an invalid Prim when there is
    /// none.
    Prim prim_at(const layer::Path& path) const;
    Prim prim_at(std::string_view path) const;
    /// Prim that the root layer's defaultPrim names; invalid when none.
    Prim default_prim() const;
    /// One instance of every prototype, in the order found: the prims whose children stand for all
    /// instances.
    std::vector<Prim> prototypes() const;
    size_t prim_count()
        const;  ///< prims composed so far, instance proxies only where they were visited

    /// Metadata of the session layers, then of the root layer, as in OpenUSD; nullopt when not
    /// authored.
    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys()
        const;                             ///< authored keys of the root layer stack, sorted
    std::string up_axis() const;           ///< "Y" or "Z"; fallback "Y"
    double meters_per_unit() const;        ///< fallback 0.01
    double time_codes_per_second() const;  ///< fallback framesPerSecond, then 24
    double frames_per_second() const;      ///< fallback 24
    double start_time_code() const;        ///< fallback 0
    double end_time_code() const;          ///< fallback 0
    bool has_time_code_range() const;      ///< one layer has both, as in OpenUSD
    std::string root_file() const;
    /// Every layer file that took part, in the order of opening.
    std::vector<std::string> layer_files() const;
    /// Identifier of the root layer of a package file; empty when it is none.
    std::string package_root_layer(const std::string& package) const;

    Diagnostics& diagnostics() const;
    /// What was wrong with the arcs of the prims composed so far, in the order found.
    std::vector<compose::CompositionError> composition_errors() const;

    const StageImpl& impl() const { return *impl_; }

  private:
    explicit Stage(std::shared_ptr<StageImpl> impl);
    std::shared_ptr<StageImpl> impl_;
};

/// Handle on one composed prim: two pointers wide at most, copy freely; valid while its Stage
/// lives.
class Prim {
  public:
    Prim() = default;

    explicit Prim(const PrimData* data) : data_(data) {}

    bool is_valid() const { return data_ != nullptr; }

    explicit operator bool() const { return is_valid(); }

    bool operator==(const Prim& o) const { return data_ == o.data_; }

    const layer::Path& path() const;
    std::string path_string() const;
    layer::Token name() const;
    layer::Token type_name() const;      ///< "Mesh"; empty for an untyped prim
    layer::Specifier specifier() const;  ///< composed: Def, Over or Class
    bool is_pseudo_root() const;
    bool is_active() const;
    bool is_defined() const;       ///< it and all ancestors have a def or class
    bool is_abstract() const;      ///< it or an ancestor is a class
    bool is_loaded() const;        ///< it and its ancestors have their payloads, or have none
    bool is_model() const;         ///< kind chain from the root is unbroken (group … component)
    bool is_instanceable() const;  ///< the metadata, whether or not it has an effect
    bool is_instance() const;  ///< its children come from a prototype shared with equal instances
    bool is_instance_proxy() const;  ///< lies below an instance
    /// True when the type is `type` or derives from it ("Gprim", "Imageable", "Xformable",
    /// "PointBased", …).
    bool is_a(std::string_view type) const;
    std::string kind() const;

    Prim parent() const;
    /// Active, loaded, defined, not abstract children in composed order: what a renderer traverses.
    /// Goes through instances (the children are then instance proxies).
    std::vector<Prim> children() const;
    /// Every child: inactive ones, overs and classes too.
    std::vector<Prim> all_children() const;
    Prim child(std::string_view name) const;

    /// Of an instance: the representative instance of its prototype (maybe itself), whose subtree
    /// has the same composed values; two instances share a prototype iff this is the same prim.
    /// Invalid for non-instances.
    Prim prototype() const;

    std::vector<layer::Token> applied_schemas() const;  ///< authored apiSchemas, list-op composed
    bool has_api(
        std::string_view schema) const;  ///< "CollectionAPI" also matches "CollectionAPI:name"

    /// Names of authored properties, sorted.
    std::vector<layer::Token> property_names() const;
    Attribute attribute(std::string_view name) const;
    Relationship relationship(std::string_view name) const;

    /// Composed metadata: strongest opinion; list-ops composed, dictionaries merged.
    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys()
        const;  ///< authored keys, sorted, composition fields left out
    /// Variant set → selection ("" = none), in composed order of the sets.
    std::vector<std::pair<std::string, std::string>> variant_selections() const;

    struct SpecSite {
        std::string layer;  ///< identifier of the layer
        std::string path;   ///< path of the spec inside it
        SourceLoc loc;
    };

    /// Specs that contribute, strongest first.
    std::vector<SpecSite> prim_stack() const;
    SourceLoc loc() const;  ///< of the strongest spec
    Diagnostics& diagnostics() const;

    const PrimData* data() const { return data_; }

  private:
    const PrimData* data_ = nullptr;
};

/// Where the value of an attribute comes from.
enum class ValueSource : uint8_t { None, Fallback, Default, TimeSamples, Spline, Clips, Blocked };

/// Handle on an attribute by name; it may have no authored spec (then only a schema fallback can
/// answer).
class Attribute {
  public:
    Attribute() = default;

    Attribute(Prim prim, layer::Token attribute_name) : prim_(prim), name_(attribute_name) {}

    /// An attribute spec is authored or the schema declares it.
    bool is_valid() const;

    explicit operator bool() const { return is_valid(); }

    bool is_authored() const;  ///< some layer has a spec for it

    Prim prim() const { return prim_; }

    layer::Token name() const { return name_; }

    std::string path_string() const;
    layer::Token type_name() const;  ///< "float3[]"; from the schema, else the strongest spec
    bool is_custom() const;
    bool is_uniform() const;

    ValueSource value_source() const;
    bool has_authored_value() const;  ///< default, samples, spline or clips, not blocked
    /// Resolved value, interpolated between samples; an empty Value when there is none or it is
    /// blocked.
    layer::Value value(TimeCode time = {}) const;
    /// Resolved value as T: exact type first, else a lossless-in-kind conversion (half, float,
    /// double, int of the same shape; string, token, asset; arrays element-wise). nullopt when
    /// absent, blocked or of another shape. T: bool, int, int64_t, float, double, std::string,
    /// Token, AssetPath, Vec2f … Vec4f, Vec2d … Vec4d, Vec2i … Vec4i, QuatFloat, QuatDouble, Mat2d
    /// … Mat4d of usd/layer/types.h, and std::vector of these.
    template <class T>
    std::optional<T> get(TimeCode time = {}) const;

    template <class T>
    T get_or(const T& otherwise, TimeCode time = {}) const {
        auto v = get<T>(time);
        return v ? *std::move(v) : otherwise;
    }

    /// Schema fallback alone.
    std::optional<layer::Value> fallback() const;
    /// Authored default alone, without samples or fallback; a block counts as a value.
    std::optional<layer::Value> authored_default() const;

    /// Times of the winning samples, ascending, in stage time; empty when the value does not come
    /// from samples.
    std::vector<double> time_samples() const;
    /// The sample authored exactly at a time of time_samples(); a block is a block Value.
    layer::Value sample_at(double time) const;
    bool might_be_time_varying() const;  ///< more than one sample, or a spline

    /// Connections, list-op composed and mapped to this stage.
    std::vector<layer::Path> connections() const;
    bool has_authored_connections() const;
    /// Absolute file name of an asset value: relative to the layer that holds the winning opinion,
    /// then search paths. Empty when there is no value; the anchored path even if no such file
    /// exists.
    std::string resolved_asset_path(TimeCode time = {}) const;
    /// The same for every element of an asset[] value.
    std::vector<std::string> resolved_asset_paths(TimeCode time = {}) const;

    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys() const;
    /// Place of the winning value opinion; the strongest spec when there is no value.
    SourceLoc loc() const;

  private:
    Prim prim_;
    layer::Token name_;
};

/// Handle on a relationship by name.
class Relationship {
  public:
    Relationship() = default;

    Relationship(Prim prim, layer::Token relationship_name)
        : prim_(prim), name_(relationship_name) {}

    bool is_valid() const;  ///< some layer has a relationship spec for it

    explicit operator bool() const { return is_valid(); }

    Prim prim() const { return prim_; }

    layer::Token name() const { return name_; }

    std::string path_string() const;
    bool is_custom() const;
    bool has_authored_targets() const;
    /// Targets, list-op composed and mapped to this stage.
    std::vector<layer::Path> targets() const;
    /// Targets with relationships among them replaced by their own targets, cycles cut.
    std::vector<layer::Path> forwarded_targets() const;
    std::optional<layer::Value> metadata(std::string_view key) const;
    std::vector<std::string> metadata_keys() const;
    SourceLoc loc() const;

  private:
    Prim prim_;
    layer::Token name_;
};

/// Calls visit for `root` and its descendants (children() order, parents first); return false to
/// skip the subtree.
void traverse(Prim root, const std::function<bool(Prim)>& visit);

}  // namespace velatura::usd::stage
