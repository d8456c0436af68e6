// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "usd/layer/layer.h"
#include "usd/layer/path.h"
#include "usd/layer/value.h"

#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

/// Builds and edits a layer in memory:
///
///     LayerBuilder builder;
///     const Path ball = Path::from("/World/Ball");
///     builder.define(ball, "Sphere");
///     builder.set(ball.append_property("radius"), "double", Value(2.0));
///     stage::open_layer(builder.layer(), {}, diagnostics);
///
/// What is there already is replaced. Errors of all functions, which then change nothing:
/// "usd-author", for a path of the wrong kind, a missing prim, an unknown type name, a value of
/// another type.
class LayerBuilder {
  public:
    /// Args: identifier: name of the layer in messages; asset paths are relative to its folder.
    explicit LayerBuilder(std::string identifier = "memory.usda");

    /// A layer of what was authored so far, which later edits do not change. Arrays are shared.
    std::shared_ptr<Layer> layer() const;

    /// Defines a prim; ancestors that are missing become untyped `def`s.
    Result<void> define(Path prim,
                        std::string_view type = {},
                        Specifier specifier = Specifier::Def);

    /// Default value of an attribute of a prim that is defined. A block hides the fallback.
    /// Args: type: "point3f[]", "token", …
    Result<void> set(Path attribute, std::string_view type, Value value);

    /// Time samples of an attribute, instead of those that it has. Its default value stays.
    Result<void> set_samples(Path attribute,
                             std::string_view type,
                             std::vector<std::pair<double, Value>> samples);

    /// Connections of an attribute to other attributes.
    Result<void> connect(Path attribute, std::string_view type, std::vector<Path> sources);

    /// Targets of a relationship of a prim that is defined.
    Result<void> set_targets(Path relationship, std::vector<Path> targets);

    /// Applies an API schema to a prim, after those that it has.
    Result<void> apply_schema(Path prim, std::string_view schema);

    /// Reference arc of a prim to a prim of this layer.
    Result<void> set_reference(Path prim, Path referenced);

    /// Metadata of a prim or property ("interpolation", "instanceable"), or of the layer ("/":
    /// "upAxis", "defaultPrim").
    Result<void> set_metadata(Path object, std::string_view key, Value value);

    /// Removes a prim or property with everything below it. Returns: whether it was there.
    bool remove(Path object);

    bool has(Path object) const { return objects_.count(object) != 0; }

  private:
    struct Object {
        Spec spec;
        std::vector<Path> children;  ///< prims and properties, in authored order
    };

    Spec& add(Path path, SpecKind kind);
    Spec* find(Path path);
    Result<Spec*> prim_spec(Path prim);
    Result<Spec*> attribute_spec(Path attribute,
                                 std::string_view type,
                                 const std::vector<const Value*>& values);

    std::string identifier_;
    std::unordered_map<Path, Object> objects_;
};

}  // namespace velatura::usd::layer
