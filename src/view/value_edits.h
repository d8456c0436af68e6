// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "compositor/bake/bake.h"
#include "view/edits_layer.h"

#include <map>
#include <string>
#include <vector>

namespace velatura::view {

/// The shortest text that reads back as the same float, which is what inputs of lights hold.
std::string float_text(double v);
/// Three of them, as a value of .usda.
std::string color_text(const Vec3d& color);
/// A matrix as a value of .usda, exact.
std::string matrix_text(const Mat4d& m);

/// Attributes of lights and cameras that were edited: by prim path, then by name.
class ValueEdits {
  public:
    /// type: as in .usda, with `uniform`. is_connected: the connection, which would win, goes.
    void set(const std::string& path,
             const std::string& name,
             const std::string& type,
             std::string value,
             bool is_connected = false);

    /// The prim's transform in world space, in place of its own and those above it.
    void set_transform(const std::string& path, const Mat4d& world);

    /// Takes over what a baked mix says of its lights; the rest stays.
    void add(const compositor::bake::Bake& bake);

    /// The prim as the scene has it.
    void remove(const std::string& path) { prims_.erase(path); }

    bool has(const std::string& path) const { return prims_.contains(path); }

    bool is_empty() const { return prims_.empty(); }

    /// As options --set of `velatura render`.
    std::vector<std::string> values() const;

    std::vector<PrimEdit> opinions() const;

    bool operator==(const ValueEdits&) const = default;

  private:
    struct Attribute {
        std::string type, value;    ///< as in .usda
        bool is_connected = false;  ///< the connection would win over the value

        bool operator==(const Attribute&) const = default;
    };

    std::map<std::string, std::map<std::string, Attribute>> prims_;
};

}  // namespace velatura::view
