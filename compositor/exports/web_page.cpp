// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_page.h"

#include "base/base64.h"
#include "compositor/exports/web_display.h"
#include "compositor/exports/web_layers.h"
#include "compositor/exports/web_pack.h"
#include "compositor/exports/web_rows.h"
#include "compositor/exports/web_text.h"
#include "compositor/look/stack_color.h"
#include "compositor/mix/mix.h"
#include "image/formats.h"

#include <Imath/half.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

namespace velatura::compositor::exports {

namespace {

using json = nlohmann::ordered_json;

/// The text between elements.
std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') {
            out += "&amp;";
        } else if (c == '<') {
            out += "&lt;";
        } else {
            out += c;
        }
    }
    return out;
}

/// JSON within an element: no `<` ends it.
std::string embedded(const json& j) {
    std::string out;
    for (const char c : j.dump(-1, ' ', true, json::error_handler_t::replace))
        out += c == '<' ? std::string("\\u003c") : std::string(1, c);
    return out;
}

/// `{{name}}` → the text; each name stands there once.
std::string filled(std::string_view page,
                   const std::vector<std::pair<std::string_view, std::string_view>>& texts) {
    std::string out;
    while (true) {
        const size_t begin = page.find("{{");
        if (begin == std::string_view::npos) break;
        const size_t end = page.find("}}", begin);
        const std::string_view name = page.substr(begin + 2, end - begin - 2);
        const auto text = std::find_if(texts.begin(), texts.end(),
                                       [&](const auto& t) { return t.first == name; });
        VELATURA_CHECK(text != texts.end(), "page.html names a text that there is not");
        out += page.substr(0, begin);
        out += text->second;
        page.remove_prefix(end + 2);
    }
    return out += page;
}

std::vector<uint8_t> display_bytes(const std::vector<float>& rgb) {
    std::vector<uint8_t> bytes(rgb.size());
    std::transform(rgb.begin(), rgb.end(), bytes.begin(), image::display_byte);
    return bytes;
}

/// The render as the window has it, of the size of the page.
Result<std::vector<float>> render_of(const LayerStack& stack, WebSize size) {
    const Look unity;
    const auto plan = mix::plan_mix(stack, unity);
    if (!plan) return plan.error();
    auto mixed =
        LayerStack::from_image(mix::apply_mix(stack, *plan, unity, false), ForeignFiles::Plain);
    if (!mixed) return mixed.error();
    const image::Window& frame = stack.image().display;
    return scaled_down(window_of(*mixed, "rgba"), {frame.width(), frame.height()}, size);
}

/// What the page shows of it before anything is touched.
std::vector<float> fold_of(const WebLayers& layers, const std::vector<size_t>& unity) {
    std::vector<float> sum(3 * size_t(layers.size.width) * size_t(layers.size.height), 0.0f);
    for (const size_t layer : unity) {
        const std::vector<uint16_t>& halves = layers.halves[layer];
        for (size_t i = 0; i < sum.size(); ++i) {
            Imath::half value;
            value.setBits(halves[i]);
            sum[i] += float(value);
        }
    }
    return sum;
}

void compare(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, WebPage& page) {
    size_t equal = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const int difference = std::abs(int(a[i]) - int(b[i]));
        equal += difference == 0;
        page.largest_difference = std::max(page.largest_difference, difference);
    }
    page.equal_share = a.empty() ? 1.0 : double(equal) / double(a.size());
}

json display_json(const WebDisplay& display) {
    if (display.kind == WebDisplay::Kind::Raw) return {{"kind", "raw"}};
    if (display.kind == WebDisplay::Kind::Srgb)
        return {{"kind", "srgb"}, {"matrix", display.matrix}};
    const std::string packed = pack_planes(display.lut, lut_size * lut_size, lut_size);
    return {{"kind", "lut"},      {"size", lut_size}, {"codes", lut_codes},
            {"scale", lut_scale}, {"max", lut_max},   {"table", to_base64(packed)}};
}

std::string planes_text(const WebLayers& layers) {
    std::string text;
    for (const std::string& packed : layers.packed)
        text += "<script type=\"text/plain\" class=\"plane\">" + packed + "</script>\n";
    return text;
}

}  // namespace

Result<WebPage> web_page(const LayerStack& stack, const Look& look, const WebOptions& options) {
    const auto rows = web_rows(stack, look, options.layers);
    if (!rows) return rows.error();
    const auto color = color_of_stack(stack, look);
    if (!color) return color.error();
    const auto transform = image::DisplayTransform::make(look.display, look.view, *color);
    if (!transform) return transform.error();
    const WebDisplay display = web_display(*transform);
    json data = rows->data;
    data["display"] = display_json(display);
    // What the page takes beside its layers
    const size_t around = embedded(data).size() + web_html().size() + web_css().size() +
                          web_javascript().size() + 100 * rows->layers.size() + 4096;
    const size_t room = options.max_bytes > around ? options.max_bytes - around : 0;
    const WebLayers layers = fitted_layers(stack, rows->layers, room);
    if (layers.packed.empty())
        return Error{"export-size",
                     fmt::format("{} layers do not fit into {:.1f} MB at any size; "
                                 "raise --max-size or choose fewer by --layers",
                                 rows->layers.size(), double(options.max_bytes) / 1e6)};
    WebPage page;
    page.width = layers.size.width;
    page.height = layers.size.height;
    page.layers = layers.packed.size();
    page.display = display.text();
    page.warnings = transform->warnings();
    if (layers.clamped > 0)
        page.warnings.push_back(fmt::format(
            "{} values are beyond what halves hold and are 65504 in the page", layers.clamped));
    auto render = render_of(stack, layers.size);
    if (!render) return render.error();
    std::vector<float> fold = fold_of(layers, rows->unity);
    transform->apply(*render);
    display.apply(fold);
    compare(display_bytes(*render), display_bytes(fold), page);

    const image::Window& frame = stack.image().display;
    data["title"] = options.title;
    data["width"] = page.width;
    data["height"] = page.height;
    data["fullWidth"] = frame.width();
    data["fullHeight"] = frame.height();
    data["pixelAspect"] = stack.image().pixel_aspect_ratio;
    data["equalShare"] = page.equal_share;
    data["largestDifference"] = page.largest_difference;
    const std::string title = escaped(options.title), values = embedded(data),
                      planes = planes_text(layers);
    page.html = filled(web_html(), {{"title", title},
                                    {"style", web_css()},
                                    {"data", values},
                                    {"planes", planes},
                                    {"script", web_javascript()}});
    return page;
}

}  // namespace velatura::compositor::exports
