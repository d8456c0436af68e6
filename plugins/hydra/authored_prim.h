// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/hydra/values.h"
#include "usd/layer/layer_builder.h"

#include <pxr/base/gf/matrix4d.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::hydra {

/// What the delegate authors of one prim, before it has a place in a layer.
class AuthoredPrim {
  public:
    explicit AuthoredPrim(std::string type = {}) : type_(std::move(type)) {}

    void set(std::string name, const PXR_NS::VtValue& value, const PXR_NS::TfToken& role = {});
    void set(std::string name, std::string type, usd::layer::Value value);
    void set_token(std::string name, std::string_view value);

    /// A primvar or other attribute with an interpolation; indices: empty where it has none.
    void set_interpolated(const std::string& name,
                          TypedValue value,
                          std::string_view interpolation,
                          const std::vector<int32_t>& indices);

    /// xformOp:transform. resets: whatever stands above in the layer.
    void set_transform(const PXR_NS::GfMatrix4d& matrix, bool resets);

    void connect(std::string name, std::string type, usd::layer::Path source);
    void target(std::string name, std::vector<usd::layer::Path> targets);

    void apply_schema(std::string schema) { schemas_.push_back(std::move(schema)); }

    void add_metadata(std::string property, std::string key, usd::layer::Value value);

    AuthoredPrim& add_child(std::string name, std::string type);

    /// Writes it into a layer. What cannot be authored is skipped with a warning.
    void author(usd::layer::LayerBuilder& builder, usd::layer::Path path) const;

  private:
    struct Attribute {
        std::string name, type;
        usd::layer::Value value;
    };

    struct Connection {
        std::string name, type;
        usd::layer::Path source;
    };

    struct Metadata {
        std::string property, key;
        usd::layer::Value value;
    };

    std::string type_;
    std::vector<Attribute> attributes_;
    std::vector<Connection> connections_;
    std::vector<std::pair<std::string, std::vector<usd::layer::Path>>> targets_;
    std::vector<Metadata> metadata_;
    std::vector<std::string> schemas_;
    std::vector<std::pair<std::string, AuthoredPrim>> children_;
};

}  // namespace velatura::hydra
