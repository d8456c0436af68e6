// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "folder_test.h"
#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/materialx/reader.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace velatura::usd::materialx {

/// Layers of documents that a test writes.
class MaterialXTest : public FolderTest {
  protected:
    using LayerPtr = std::shared_ptr<layer::Layer>;

    std::string path(const std::string& name) const { return (folder_ / name).string(); }

    Result<LayerPtr> read(const std::string& text, const std::string& file = "test.mtlx") {
        return read_materialx_layer(make_asset_bytes(text), path(file), diagnostics_);
    }

    /// Of the elements in a <materialx> element.
    LayerPtr layer_of(const std::string& elements,
                      const std::string& attributes = "version=\"1.38\"") {
        auto layer = read("<?xml version=\"1.0\"?>\n<materialx " + attributes + ">\n" + elements +
                          "\n</materialx>\n");
        EXPECT_TRUE(layer.has_value());
        return layer ? *layer : nullptr;
    }

    static const layer::Value* value(const layer::Layer& layer, const std::string& path) {
        return layer.field(layer::Path::from(path), layer::fields().default_value);
    }

    static std::string token(const layer::Layer& layer, const std::string& path) {
        const layer::Value* v = value(layer, path);
        return v ? v->get_or(layer::Token()).str() : "";
    }

    static std::string connection(const layer::Layer& layer, const std::string& path) {
        const auto* op = layer.field_as<layer::PathListOp>(layer::Path::from(path),
                                                           layer::fields().connection_paths);
        return op && op->explicit_items.size() == 1 ? op->explicit_items[0].to_string() : "";
    }

    static std::string type(const layer::Layer& layer, const std::string& path) {
        const layer::Spec* spec = layer.spec(layer::Path::from(path));
        return spec ? spec->type_name().str() : "nothing";
    }

    size_t count(const std::string& code) const {
        size_t n = 0;
        for (const Diagnostic& d : diagnostics_.all()) n += d.code == code ? 1 : 0;
        return n;
    }

    Diagnostics diagnostics_;
};

}  // namespace velatura::usd::materialx
