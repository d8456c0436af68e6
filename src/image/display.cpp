// SPDX-License-Identifier: Apache-2.0
#include "image/display.h"

#include "base/nearest_names.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace velatura::image {

namespace ocio = OCIO_NAMESPACE;

namespace {

/// Row-major 4×4 matrix of a 3×3 one.
ocio::MatrixTransformRcPtr matrix_transform(const std::array<double, 9>& m) {
    const double full[16] = {m[0], m[1], m[2], 0, m[3], m[4], m[5], 0,
                             m[6], m[7], m[8], 0, 0,    0,    0,    1};
    auto transform = ocio::MatrixTransform::Create();
    transform->setMatrix(full);
    return transform;
}

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

/// Reference: scene ACES2065-1, display CIE XYZ D65. The matrices are products of the published
/// primaries (SMPTE ST 2065-1, ITU-R BT.709) with Bradford adaptation D65 → ACES white.
ocio::ConstConfigRcPtr built_in_config() {
    auto config = ocio::Config::Create();
    config->setMajorVersion(2);
    config->addColorSpace(scene_space("ACES2065-1", nullptr));
    config->addColorSpace(scene_space("ACEScg", builtin("ACEScg_to_ACES2065-1")));
    config->addColorSpace(scene_space(
        "lin_rec709", matrix_transform({0.439632981919, 0.382988698152, 0.177378319929,
                                        0.089776442959, 0.813439428749, 0.096784128292,
                                        0.017541170383, 0.111546553302, 0.870912276315})));
    auto raw = scene_space("raw", nullptr);
    raw->setIsData(true);
    config->addColorSpace(raw);
    config->setRole(ocio::ROLE_SCENE_LINEAR, "lin_rec709");
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

/// ` (did you mean 'ACES'?)` for a display or view that the config lacks.
std::string nearest_view(const ocio::ConstConfigRcPtr& config,
                         const std::string& display,
                         const std::string& view) {
    std::vector<std::string> displays, views;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        displays.emplace_back(config->getDisplay(d));
        for (int v = 0; v < config->getNumViews(displays.back().c_str()); ++v)
            views.emplace_back(config->getView(displays.back().c_str(), v));
    }
    const bool has_display =
        display.empty() || std::find(displays.begin(), displays.end(), display) != displays.end();
    return has_display ? did_you_mean(view, views) : did_you_mean(display, displays);
}

std::string list_of_views(const ocio::ConstConfigRcPtr& config) {
    std::string list;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        const char* display = config->getDisplay(d);
        for (int v = 0; v < config->getNumViews(display); ++v) {
            list += fmt::format("{}{} / {}", list.empty() ? "" : ", ", display,
                                config->getView(display, v));
        }
    }
    return list;
}

struct UsedConfig {
    ocio::ConstConfigRcPtr config;
    bool is_built_in = false;
};

/// That of $OCIO, else the built-in one.
Result<UsedConfig> used_config() {
    try {
        // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody changes the environment
        const char* path = std::getenv("OCIO");
        const bool is_built_in = path == nullptr || *path == '\0';
        return UsedConfig{is_built_in ? built_in_config() : ocio::Config::CreateFromEnv(),
                          is_built_in};
    } catch (const std::exception& e) {
        return Error{"ocio-config", fmt::format("cannot use the OpenColorIO config: {}", e.what())};
    }
}

}  // namespace

std::string working_space_of(const Image& image) {
    const auto at = image.attributes.find("chromaticities");
    const auto* primaries =
        at == image.attributes.end() ? nullptr : std::get_if<Chromaticities>(&at->second);
    return primaries && std::abs((*primaries)[0] - 0.713f) < 0.002f ? "ACEScg" : "";
}

Result<std::vector<DisplayViews>> display_views() {
    const auto used = used_config();
    if (!used) return used.error();
    const ocio::ConstConfigRcPtr& config = used->config;
    std::vector<DisplayViews> all;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        DisplayViews of_display;
        of_display.display = config->getDisplay(d);
        const char* display = of_display.display.c_str();
        for (int v = 0; v < config->getNumViews(display); ++v)
            of_display.views.emplace_back(config->getView(display, v));
        const bool is_default = of_display.display == config->getDefaultDisplay();
        all.insert(is_default ? all.begin() : all.end(), std::move(of_display));
    }
    return all;
}

struct DisplayTransform::Impl {
    ocio::ConstCPUProcessorRcPtr processor;
};

DisplayTransform::DisplayTransform(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

DisplayTransform::~DisplayTransform() = default;
DisplayTransform::DisplayTransform(DisplayTransform&&) noexcept = default;
DisplayTransform& DisplayTransform::operator=(DisplayTransform&&) noexcept = default;

Result<DisplayTransform> DisplayTransform::make(const std::string& display,
                                                const std::string& view,
                                                const std::string& working_space) {
    const auto used = used_config();
    if (!used) return used.error();
    const auto& [config, is_built_in] = *used;
    try {
        const std::string known_display = display.empty() ? config->getDefaultDisplay() : display;
        const std::string known_view =
            view.empty() ? config->getDefaultView(known_display.c_str()) : view;
        const std::string space = !working_space.empty() ? working_space
                                  : is_built_in          ? std::string("lin_rec709")
                                                         : std::string(ocio::ROLE_SCENE_LINEAR);
        auto transform = ocio::DisplayViewTransform::Create();
        transform->setSrc(space.c_str());
        transform->setDisplay(known_display.c_str());
        transform->setView(known_view.c_str());
        auto impl = std::make_unique<Impl>();
        impl->processor = config->getProcessor(transform)->getDefaultCPUProcessor();
        return DisplayTransform(std::move(impl));
    } catch (const std::exception& e) {
        return Error{
            "ocio-view",
            fmt::format("no display transform for display '{}' view '{}'{}: {}; there are: {}",
                        display, view, nearest_view(config, display, view), e.what(),
                        list_of_views(config))};
    }
}

void DisplayTransform::apply(std::vector<float>& rgb) const {
    if (rgb.empty()) return;
    ocio::PackedImageDesc image(rgb.data(), long(rgb.size() / 3), 1, 3);
    impl_->processor->apply(image);
}

}  // namespace velatura::image
