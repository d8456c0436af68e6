// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "translate/translate.h"

#include <string>
#include <vector>

namespace velatura::translate {

/// A scene of a .usda text and what was said about it.
struct Translated {
    scene::Scene scene;
    Diagnostics diagnostics;
    std::string error;  ///< code of the Error, empty when there is a scene
    std::string error_message;

    size_t count(const std::string& code) const;

    const scene::Mesh& mesh(size_t i) const {
        return std::get<scene::Mesh>(scene.shapes[i].geometry);
    }

    /// What the instance hands down under the name; empty when it is nothing.
    std::vector<float> inherited(size_t instance, const std::string& primvar) const;

    /// Messages of the code, one a line.
    std::string messages(const std::string& code) const;

    const scene::Gprim& gprim(size_t i) const {
        return std::get<scene::Gprim>(scene.shapes[i].geometry);
    }
};

/// Translates a stage of this body behind `#usda 1.0`, or of a whole file when it starts with '#'.
void translate_text(const std::string& text, Translated& out, const TranslateOptions& options = {});

/// The same at a time code; a stage without a scene fails the test.
void translate_at(double time, const std::string& text, Translated& out);

/// Where a placement puts the origin.
Vec3 position(const Mat4& render_from_local);

/// Placement at key k of a moving instance: the end of segment k − 1.
const Mat4& key(const scene::Instance& instance, size_t k);

/// A quad of edge 1 in the xy plane named `name`, with extra lines inside its body and metadata.
std::string quad(const std::string& name, const std::string& extra = "");

/// A camera at the origin.
std::string camera(const std::string& extra = "");

}  // namespace velatura::translate
