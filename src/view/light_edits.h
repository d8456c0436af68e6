// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/bake/bake.h"
#include "view/edits_layer.h"

#include <map>
#include <string>
#include <vector>

namespace velatura::view {

/// Inputs of lights that were edited: by prim path, then by name.
class LightEdits {
  public:
    /// Takes over what a baked mix says of its lights; the rest stays.
    void add(const compositor::bake::Bake& bake);

    bool is_empty() const { return lights_.empty(); }

    /// As options --set of `velatura render`.
    std::vector<std::string> values() const;

    std::vector<PrimEdit> opinions() const;

    bool operator==(const LightEdits&) const = default;

  private:
    struct Input {
        std::string type, value;    ///< as in .usda
        bool is_connected = false;  ///< the connection would win over the value

        bool operator==(const Input&) const = default;
    };

    std::map<std::string, std::map<std::string, Input>> lights_;
};

}  // namespace velatura::view
