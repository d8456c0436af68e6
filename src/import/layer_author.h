// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/layer.h"
#include "usd/layer/path.h"
#include "usd/layer/value.h"

#include <string>
#include <string_view>
#include <unordered_map>

namespace velatura::import {

using usd::layer::Path;
using usd::layer::Value;

/// The name made a USD identifier: what cannot stand in one becomes '_'.
std::string valid_name(std::string_view name, std::string_view otherwise);

/// Writes opinions into a layer.
class LayerAuthor {
  public:
    explicit LayerAuthor(usd::layer::Layer& layer) : layer_(layer) {}

    /// A new prim with a valid name that no sibling has; displayName keeps the wanted one when it
    /// had to change.
    Path define(Path parent,
                std::string_view wanted_name,
                std::string_view type,
                usd::layer::Specifier specifier = usd::layer::Specifier::Def);
    void metadata(Path spec, std::string_view name, Value value);
    void stage_metadata(std::string_view name, Value value);
    Path attribute(Path prim, std::string_view name, std::string_view type, Value value);
    Path uniform(Path prim, std::string_view name, std::string_view type, Value value);
    /// A primvar or other attribute with an interpolation.
    void interpolated(Path prim,
                      std::string_view name,
                      std::string_view type,
                      std::string_view interpolation,
                      Value value);
    /// An attribute without a value that takes it from `source`.
    void connect(Path prim, std::string_view name, std::string_view type, Path source);
    /// An attribute without a value, such as a shader's output.
    Path declare(Path prim, std::string_view name, std::string_view type);
    void relationship(Path prim, std::string_view name, Path target);
    void apply_schema(Path prim, std::string_view schema);
    void token(Path prim, std::string_view name, std::string_view value);
    void uniform_token(Path prim, std::string_view name, std::string_view value);

  private:
    usd::layer::Layer& layer_;
    std::unordered_map<Path, int> next_number_;
};

}  // namespace velatura::import
