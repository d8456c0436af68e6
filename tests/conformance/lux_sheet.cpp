// SPDX-License-Identifier: Apache-2.0
#include "lux_sheet.h"

#include "lux_render.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace velatura::test {

LuxSheet::LuxSheet(const std::string& name, const nlohmann::json& description)
    : name_(name),
      description_(description),
      stage_(open_stage(luxtest_folder() / description.at("usd_path").get<std::string>())) {
    usd::stage::traverse(stage_.pseudo_root(), [this](usd::stage::Prim prim) {
        if (prim.type_name().view().ends_with("Light")) light_ = prim;
        return true;
    });
}

std::vector<int> LuxSheet::frames() const {
    std::vector<int> out;
    for (const nlohmann::json& group : description_.at("frame_groups")) {
        const int first = group.at("frames").at(0), last = group.at("frames").at(1);
        for (int frame = first; frame <= last; ++frame) out.push_back(frame);
    }
    return out;
}

LuxLight LuxSheet::light(double frame) const {
    static const std::map<std::string, LuxLight::Kind> kinds = {
        {"RectLight", LuxLight::Kind::Rect},
        {"DiskLight", LuxLight::Kind::Disk},
        {"SphereLight", LuxLight::Kind::Sphere},
        {"CylinderLight", LuxLight::Kind::Cylinder},
        {"DistantLight", LuxLight::Kind::Distant}};
    LuxLight light;
    light.kind = kinds.at(std::string(light_.type_name().view()));
    light.world_from_light = usd::stage::world_transform(light_, frame);
    light.width = number("inputs:width", 1, frame);
    light.height = number("inputs:height", 1, frame);
    light.radius = number("inputs:radius", 0.5, frame);
    light.length = number("inputs:length", 1, frame);
    light.angle_deg = number("inputs:angle", 0.53, frame);
    const auto color = light_.attribute("inputs:color").get<Vec3d>(frame);
    const double intensity =
        number("inputs:intensity", light.kind == LuxLight::Kind::Distant ? 50000 : 1, frame);
    light.emission =
        color.value_or(Vec3d(1.0)) * (intensity * std::exp2(number("inputs:exposure", 0, frame)) *
                                      number("inputs:diffuse", 1, frame));
    if (light_.attribute("inputs:enableColorTemperature").get_or<bool>(false, frame))
        light.kelvin = number("inputs:colorTemperature", 6500, frame);
    light.is_normalized = light_.attribute("inputs:normalize").get_or<bool>(false, frame);
    // A cone that nobody speaks of cuts nothing (only in ies_scale)
    light.cone_angle_deg = light_.attribute("inputs:shaping:cone:angle").has_authored_value()
                               ? number("inputs:shaping:cone:angle", 90, frame)
                               : 180;
    light.cone_softness = number("inputs:shaping:cone:softness", 0, frame);
    light.focus = number("inputs:shaping:focus", 0, frame);
    light.focus_tint =
        light_.attribute("inputs:shaping:focusTint").get<Vec3d>(frame).value_or(Vec3d(0.0));
    if (const std::string file = ies_file(frame); !file.empty()) {
        light.ies = std::make_shared<const LuxIes>(luxtest_folder() / "usd" / file);
        light.ies_angle_scale = number("inputs:shaping:ies:angleScale", 0, frame);
        if (light_.attribute("inputs:shaping:ies:normalize").get_or<bool>(false, frame))
            light.ies_divisor = light.ies->mean();
    }
    return light;
}

void LuxSheet::expect_value(int frame,
                            const std::string& attribute,
                            const nlohmann::json& value) const {
    const usd::stage::Attribute a = light_.attribute(attribute);
    const std::string what = fmt::format("{} frame {} {}", name_, frame, attribute);
    if (value.is_boolean()) {
        EXPECT_EQ(a.get<bool>(frame), value.get<bool>()) << what;
    } else if (value.is_number()) {
        EXPECT_EQ(a.get<double>(frame), value.get<double>()) << what;
    } else if (value.is_string()) {
        EXPECT_EQ(a.get<std::string>(frame), value.get<std::string>()) << what;
    } else if (value.size() == 3) {
        const auto rgb = value.get<std::vector<double>>();
        EXPECT_EQ(a.get<Vec3d>(frame), Vec3d(rgb[0], rgb[1], rgb[2])) << what;
    } else {
        const auto rows = value.get<std::vector<std::vector<double>>>();
        const auto matrix = a.get<Mat4d>(frame);
        ASSERT_TRUE(matrix) << what;
        for (int i = 0; i < 16; ++i)
            EXPECT_EQ((*matrix)[i / 4][i % 4], rows.at(size_t(i) / 4).at(size_t(i) % 4)) << what;
    }
}

void LuxSheet::expect_described_values() const {
    for (const nlohmann::json& group : description_.at("frame_groups")) {
        const int first = group.at("frames").at(0), last = group.at("frames").at(1);
        for (int frame = first; frame <= last; ++frame) {
            for (const auto& [attribute, value] : group.at("non_default_constants").items())
                expect_value(frame, attribute, value);
            for (const auto& [attribute, values] : group.at("varying").items())
                expect_value(frame, attribute, values.at(std::to_string(frame)));
        }
    }
}

}  // namespace velatura::test
