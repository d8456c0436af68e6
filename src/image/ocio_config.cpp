// SPDX-License-Identifier: Apache-2.0
#include "image/ocio_config.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>

namespace velatura::image {

namespace ocio = OCIO_NAMESPACE;

namespace {

ocio::BuiltinTransformRcPtr builtin(const char* style) {
    auto transform = ocio::BuiltinTransform::Create();
    transform->setStyle(style);
    return transform;
}

ocio::ColorSpaceRcPtr scene_space(const char* name, const ocio::ConstTransformRcPtr& to_reference) {
    auto space = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_SCENE);
    space->setName(name);
    if (to_reference) space->setTransform(to_reference, ocio::COLORSPACE_DIR_TO_REFERENCE);
    return space;
}

/// Reference: scene ACES2065-1, display CIE XYZ D65.
ocio::ConstConfigRcPtr built_in_config() {
    auto config = ocio::Config::Create();
    config->setMajorVersion(2);
    config->addColorSpace(scene_space("ACES2065-1", nullptr));
    config->addColorSpace(scene_space("ACEScg", builtin("ACEScg_to_ACES2065-1")));
    config->addColorSpace(
        scene_space("lin_rec709", matrix_transform(*aces_from_rgb(linear_rec709().primaries))));
    auto raw = scene_space("raw", nullptr);
    raw->setIsData(true);
    config->addColorSpace(raw);
    config->setRole(ocio::ROLE_SCENE_LINEAR, "lin_rec709");
    config->setRole(ocio::ROLE_INTERCHANGE_SCENE, "ACES2065-1");
    config->setRole(ocio::ROLE_DEFAULT, "raw");

    auto srgb = ocio::ColorSpace::Create(ocio::REFERENCE_SPACE_DISPLAY);
    srgb->setName("sRGB - Display");
    srgb->setTransform(builtin("DISPLAY - CIE-XYZ-D65_to_sRGB"),
                       ocio::COLORSPACE_DIR_FROM_REFERENCE);
    config->addColorSpace(srgb);

    auto aces = ocio::ViewTransform::Create(ocio::REFERENCE_SPACE_SCENE);
    aces->setName("ACES 1.0 SDR-video");
    aces->setTransform(builtin("ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0"),
                       ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE);
    config->addViewTransform(aces);
    auto plain = ocio::ViewTransform::Create(ocio::REFERENCE_SPACE_SCENE);
    plain->setName("Un-tone-mapped");
    plain->setTransform(builtin("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD"),
                        ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE);
    config->addViewTransform(plain);
    config->setDefaultViewTransformName("Un-tone-mapped");

    config->addDisplayView("sRGB", "ACES", "ACES 1.0 SDR-video", "sRGB - Display", "", "", "");
    config->addDisplayView("sRGB", "sRGB", "Un-tone-mapped", "sRGB - Display", "", "", "");
    config->addDisplayView("sRGB", "Raw", "raw", "");
    config->validate();
    return config;
}

/// What a linear way from one space to another multiplies by; none for ways that are not linear.
std::optional<ColorMatrix> matrix_between(const ocio::ConstConfigRcPtr& config,
                                          const std::string& from,
                                          const std::string& to) {
    // Nothing, each channel alone, all of them, and twice and a fifth of that
    std::array<std::array<float, 3>, 7> probes = {
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {2, 2, 2}, {0.2f, 0.2f, 0.2f}}};
    try {
        ocio::PackedImageDesc image(probes[0].data(), long(probes.size()), 1, 3);
        config->getProcessor(from.c_str(), to.c_str())->getDefaultCPUProcessor()->apply(image);
    } catch (const ocio::Exception&) {
        return std::nullopt;
    }
    ColorMatrix m{};
    for (size_t row = 0; row < 3; ++row) {
        double sum = 0;
        for (size_t c = 0; c < 3; ++c) sum += m[3 * row + c] = double(probes[1 + c][row]);
        const auto is_near = [](float value, double expected) {
            return std::abs(double(value) - expected) < 1e-3;
        };
        if (!is_near(probes[0][row], 0) || !is_near(probes[4][row], sum) ||
            !is_near(probes[5][row], 2 * sum) || !is_near(probes[6][row], 0.2 * sum))
            return std::nullopt;
    }
    return m;
}

bool is_near(const ColorMatrix& a, const ColorMatrix& b) {
    for (size_t i = 0; i < a.size(); ++i) {
        if (std::abs(a[i] - b[i]) > 2e-3) return false;
    }
    return true;
}

std::optional<ReferenceSpace> anchor_by_matrices(const ocio::ConstConfigRcPtr& config) {
    const auto linear = config->getColorSpace(ocio::ROLE_SCENE_LINEAR);
    if (!linear) return std::nullopt;
    for (const std::string& name : space_names(*config)) {
        const auto space = config->getColorSpace(name.c_str());
        if (!space || space->isData() || name == linear->getName()) continue;
        const auto matrix = matrix_between(config, name, linear->getName());
        if (!matrix) continue;
        for (const StandardSpace& to : standard_spaces()) {
            const ColorMatrix aces_from_to = *aces_from_rgb(to.primaries);
            for (const StandardSpace& from : standard_spaces()) {
                const ColorMatrix between =
                    product(*inverse(aces_from_to), *aces_from_rgb(from.primaries));
                if (&from != &to && is_near(*matrix, between))
                    return ReferenceSpace{linear->getName(), aces_from_to};
            }
        }
    }
    return std::nullopt;
}

}  // namespace

ocio::MatrixTransformRcPtr matrix_transform(const ColorMatrix& m) {
    const double full[16] = {m[0], m[1], m[2], 0, m[3], m[4], m[5], 0,
                             m[6], m[7], m[8], 0, 0,    0,    0,    1};
    auto transform = ocio::MatrixTransform::Create();
    transform->setMatrix(full);
    return transform;
}

Result<ActiveConfig> active_config() {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody changes the environment
    const char* const variable = std::getenv("OCIO");
    const std::string path = variable ? variable : "";
    // Configs of studios take tenths of a second to read, and each frame of a sequence asks
    static std::mutex mutex;
    static std::map<std::string, ocio::ConstConfigRcPtr> read;
    const std::scoped_lock lock(mutex);
    try {
        ocio::ConstConfigRcPtr& config = read[path];
        if (!config) config = path.empty() ? built_in_config() : ocio::Config::CreateFromEnv();
        return ActiveConfig{config, path.empty()};
    } catch (const std::exception& e) {
        return Error{"ocio-config", fmt::format("cannot use the OpenColorIO config: {}", e.what())};
    }
}

std::vector<std::string> space_names(const ocio::Config& config) {
    std::vector<std::string> names;
    for (int i = 0; i < config.getNumColorSpaces(); ++i)
        names.emplace_back(config.getColorSpaceNameByIndex(i));
    return names;
}

std::optional<ReferenceSpace> anchor_of(const ocio::ConstConfigRcPtr& config) {
    if (const auto aces = config->getColorSpace(ocio::ROLE_INTERCHANGE_SCENE))
        return ReferenceSpace{aces->getName(), {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    for (const StandardSpace& known : standard_spaces()) {
        for (const std::string_view name : known.names) {
            const auto space = config->getColorSpace(std::string(name).c_str());
            if (space && !space->isData())
                return ReferenceSpace{space->getName(), *aces_from_rgb(known.primaries)};
        }
    }
    if (const auto xyz = config->getColorSpace(ocio::ROLE_INTERCHANGE_DISPLAY))
        return ReferenceSpace{xyz->getName(),
                              *aces_from_rgb(standard_space("lin_ciexyzd65_scene")->primaries)};
    return anchor_by_matrices(config);
}

std::optional<ColorMatrix> aces_from_space(const ocio::ConstConfigRcPtr& config,
                                           const std::string& space) {
    const auto anchor = anchor_of(config);
    if (!anchor) return std::nullopt;
    const auto matrix = matrix_between(config, space, anchor->space);
    if (!matrix) return std::nullopt;
    return product(anchor->aces_from_space, *matrix);
}

}  // namespace velatura::image
