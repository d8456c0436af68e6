// SPDX-License-Identifier: Apache-2.0
#include "image/exr_header.h"

#include "base/json_depth.h"

#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOpaqueAttribute.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <OpenEXR/ImfVersion.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string_view>

namespace velatura::image {

namespace {

/// What an attribute writes, in memory.
class ByteSink : public Imf::OStream {
  public:
    ByteSink() : Imf::OStream("attribute") {}

    void write(const char* c, int n) override {
        bytes.resize(std::max(bytes.size(), at_ + size_t(n)));
        std::memcpy(bytes.data() + at_, c, size_t(n));
        at_ += size_t(n);
    }

    uint64_t tellp() override { return at_; }

    void seekp(uint64_t position) override { at_ = size_t(position); }

    std::string bytes;

  private:
    size_t at_ = 0;
};

class ByteSource : public Imf::IStream {
  public:
    explicit ByteSource(const std::string& bytes) : Imf::IStream("attribute"), bytes_(bytes) {}

    bool read(char* c, int n) override {
        if (size_t(n) > bytes_.size() - at_) throw std::invalid_argument("attribute too short");
        std::memcpy(c, bytes_.data() + at_, size_t(n));
        at_ += size_t(n);
        return at_ < bytes_.size();
    }

    uint64_t tellg() override { return at_; }

    void seekg(uint64_t position) override { at_ = std::min(size_t(position), bytes_.size()); }

  private:
    const std::string& bytes_;
    size_t at_ = 0;
};

OtherAttribute other_attribute(const Imf::Attribute& from) {
    ByteSink sink;
    from.writeValueTo(sink, Imf::EXR_VERSION);
    return {from.typeName(), std::move(sink.bytes)};
}

void insert_other(Imf::Header& header, const std::string& name, const OtherAttribute& other) {
    std::unique_ptr<Imf::Attribute> attribute(Imf::Attribute::knownType(other.type.c_str())
                                                  ? Imf::Attribute::newAttribute(other.type.c_str())
                                                  : new Imf::OpaqueAttribute(other.type.c_str()));
    ByteSource source(other.bytes);
    attribute->readValueFrom(source, int(other.bytes.size()), Imf::EXR_VERSION);
    header.insert(name, *attribute);
}

void read_attribute(const Imf::Attribute& from, const std::string& name, Attributes& to) {
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&from)) {
        // The reader of Cryptomatte manifests checks their depth itself
        if (name.starts_with("velatura/") && is_json_too_deep(s->value()))
            throw std::invalid_argument(
                fmt::format("the header string {} is nested too deeply", name));
        to[name] = s->value();
    } else if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(&from)) {
        to[name] = i->value();
    } else if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&from)) {
        to[name] = f->value();
    } else if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(&from)) {
        to[name] = d->value();
    } else if (const auto* r = dynamic_cast<const Imf::RationalAttribute*>(&from);
               r && name == "framesPerSecond") {
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
    } else {
        to[name] = other_attribute(from);
    }
}

/// Attributes that OpenEXR itself manages.
bool is_structural(const std::string& name) {
    constexpr const char* own[] = {"channels",      "compression", "dataWindow",
                                   "displayWindow", "lineOrder",   "pixelAspectRatio",
                                   "name",          "type",        "version",
                                   "chunkCount",    "tiles",       "maxSamplesPerPixel",
                                   "deepImageState"};
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
    } else if (const auto* o = std::get_if<OtherAttribute>(&attribute)) {
        insert_other(header, name, *o);
    }
}

void read_attributes(const Imf::Header& header, Attributes& to) {
    const bool is_usual_screen =
        header.screenWindowCenter() == Imath::V2f(0, 0) && header.screenWindowWidth() == 1.0f;
    for (auto a = header.begin(); a != header.end(); ++a) {
        const bool is_screen = std::string_view(a.name()).starts_with("screenWindow");
        if (!is_structural(a.name()) && !(is_screen && is_usual_screen))
            read_attribute(a.attribute(), a.name(), to);
    }
}

}  // namespace velatura::image
