// SPDX-License-Identifier: Apache-2.0
#include "image/exr_header.h"

#include "base/json_depth.h"

#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace velatura::image {

namespace {

void read_attribute(const Imf::Attribute& from, const std::string& name, Attributes& to) {
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&from)) {
        const bool is_json = name.starts_with("velatura/") || name.starts_with("cryptomatte/");
        if (is_json && is_json_too_deep(s->value()))
            throw std::invalid_argument(
                fmt::format("the header string {} is nested too deeply", name));
        to[name] = s->value();
    } else if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(&from)) {
        to[name] = i->value();
    } else if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&from)) {
        to[name] = f->value();
    } else if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(&from)) {
        to[name] = d->value();
    } else if (const auto* r = dynamic_cast<const Imf::RationalAttribute*>(&from)) {
        to[name] = double(r->value());
    } else if (const auto* v = dynamic_cast<const Imf::V2fAttribute*>(&from)) {
        to[name] = std::array<float, 2>{v->value().x, v->value().y};
    } else if (const auto* m = dynamic_cast<const Imf::M44fAttribute*>(&from)) {
        Matrix44 matrix{};
        for (int row = 0; row < 4; ++row) {
            for (int c = 0; c < 4; ++c) matrix[size_t(4 * row + c)] = m->value()[row][c];
        }
        to[name] = matrix;
    } else if (const auto* p = dynamic_cast<const Imf::ChromaticitiesAttribute*>(&from)) {
        const Imf::Chromaticities& c = p->value();
        to[name] = Chromaticities{c.red.x,  c.red.y,  c.green.x, c.green.y,
                                  c.blue.x, c.blue.y, c.white.x, c.white.y};
    }
}

/// Attributes that OpenEXR itself manages.
bool is_structural(const std::string& name) {
    constexpr const char* own[] = {"channels",
                                   "compression",
                                   "dataWindow",
                                   "displayWindow",
                                   "lineOrder",
                                   "pixelAspectRatio",
                                   "screenWindowCenter",
                                   "screenWindowWidth",
                                   "name",
                                   "type",
                                   "version",
                                   "chunkCount",
                                   "tiles",
                                   "view"};
    return std::any_of(std::begin(own), std::end(own), [&](const char* n) { return name == n; });
}

}  // namespace

Imath::Box2i exr_box(const Window& w) {
    return {{w.x0, w.y0}, {w.x1 - 1, w.y1 - 1}};
}

Window window_of(const Imath::Box2i& b) {
    return {b.min.x, b.min.y, b.max.x + 1, b.max.y + 1};
}

void insert_attribute(Imf::Header& header, const std::string& name, const Attribute& attribute) {
    if (const auto* s = std::get_if<std::string>(&attribute)) {
        header.insert(name, Imf::StringAttribute(*s));
    } else if (const auto* i = std::get_if<int>(&attribute)) {
        header.insert(name, Imf::IntAttribute(*i));
    } else if (const auto* f = std::get_if<float>(&attribute)) {
        header.insert(name, Imf::FloatAttribute(*f));
    } else if (const auto* d = std::get_if<double>(&attribute)) {
        // The one standard attribute of a rate is rational
        if (name == "framesPerSecond") {
            header.insert(name, Imf::RationalAttribute(Imf::Rational(*d)));
        } else {
            header.insert(name, Imf::DoubleAttribute(*d));
        }
    } else if (const auto* v = std::get_if<std::array<float, 2>>(&attribute)) {
        header.insert(name, Imf::V2fAttribute(Imath::V2f((*v)[0], (*v)[1])));
    } else if (const auto* m = std::get_if<Matrix44>(&attribute)) {
        Imath::M44f matrix;
        for (int r = 0; r < 4; ++r) {
            for (int c = 0; c < 4; ++c) matrix[r][c] = (*m)[size_t(4 * r + c)];
        }
        header.insert(name, Imf::M44fAttribute(matrix));
    } else if (const auto* p = std::get_if<Chromaticities>(&attribute)) {
        const auto& c = *p;
        header.insert(name, Imf::ChromaticitiesAttribute(Imf::Chromaticities(
                                {c[0], c[1]}, {c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]})));
    }
}

void read_attributes(const Imf::Header& header, Attributes& to) {
    for (auto a = header.begin(); a != header.end(); ++a) {
        if (!is_structural(a.name())) read_attribute(a.attribute(), a.name(), to);
    }
}

}  // namespace velatura::image
