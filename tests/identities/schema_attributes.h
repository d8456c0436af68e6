// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"

#include <functional>
#include <string>
#include <vector>

namespace velatura::test {

/// How one attribute is shown to work: its stage with and without it are different images, and with
/// it the image is that of a twin, or has a known value in the middle, or a number is in the scene.
struct AttributeRow {
    std::string schema, attribute;
    /// Prims, `$` where the attribute is authored; before them a camera and a white dome, but for
    /// whole files, which begin with `#`. A line `@dark` makes the dome black, a line `@close T`
    /// closes the shutter at T.
    std::string stage;
    std::string authored;
    std::string twin = {};            ///< the same image by another route; empty: see the next two
    std::vector<double> middle = {};  ///< RGB of the central pixels: the closed form
    /// What the scene holds; with `value` where it is authored and another one where it is not.
    std::function<double(const scene::Scene&)> read = {};
    double value = 0;
    bool is_rendered = true;    ///< else the scene alone is compared
    double tolerance = 2e-3;    ///< relative, of images
    const char* settings = "";  ///< RenderPass or RenderSettings to render
};

/// Every attribute that velatura::translate calls used. `folder` holds the file of
/// write_lamp().
std::vector<AttributeRow> attribute_rows(const std::string& folder);
void write_lamp(const std::string& folder);

/// The parts of attribute_rows().
std::vector<AttributeRow> geometry_rows();
std::vector<AttributeRow> skeleton_rows();
std::vector<AttributeRow> camera_rows();
std::vector<AttributeRow> light_rows(const std::string& folder);
std::vector<AttributeRow> material_rows();
std::vector<AttributeRow> settings_rows();

/// Transform of one op: `op("rotateZ", "45")`.
std::string op(const std::string& kind, const std::string& value);
std::string at(const std::string& position);

}  // namespace velatura::test
