// SPDX-License-Identifier: Apache-2.0
#include "made_exr.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>

#include <cstddef>
#include <cstdint>

namespace velatura::image {

namespace {

/// All rows from one row in memory.
template <class T>
void add_channels(const std::vector<std::string>& names,
                  Imf::PixelType type,
                  std::vector<T>& row,
                  int x0,
                  Imf::FrameBuffer& buffer) {
    char* const base = reinterpret_cast<char*>(row.data()) - std::ptrdiff_t(sizeof(T)) * x0;
    for (const std::string& name : names) buffer.insert(name, Imf::Slice(type, base, sizeof(T), 0));
}

}  // namespace

void make_exr(const std::string& path, const std::vector<MadePart>& parts) {
    std::vector<Imf::Header> headers;
    for (const MadePart& part : parts) {
        const Window& w = part.window;
        Imf::Header header(Imath::Box2i({0, 0}, {63, 63}),
                           Imath::Box2i({w.x0, w.y0}, {w.x1 - 1, w.y1 - 1}));
        header.compression() = part.compression;
        for (const std::string& c : part.halves)
            header.channels().insert(c, Imf::Channel(Imf::HALF));
        for (const std::string& c : part.floats)
            header.channels().insert(c, Imf::Channel(Imf::FLOAT));
        for (const std::string& c : part.uints)
            header.channels().insert(c, Imf::Channel(Imf::UINT));
        header.setName(part.name);
        header.setType(Imf::SCANLINEIMAGE);
        headers.push_back(std::move(header));
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), int(headers.size()));
    for (size_t i = 0; i < parts.size(); ++i) {
        const Window& w = parts[i].window;
        const auto width = size_t(w.width());
        std::vector<Imath::half> halves(width, Imath::half(1.0f));
        std::vector<float> floats(width, 1.0f);
        std::vector<uint32_t> uints(width, 1);
        Imf::FrameBuffer buffer;
        add_channels(parts[i].halves, Imf::HALF, halves, w.x0, buffer);
        add_channels(parts[i].floats, Imf::FLOAT, floats, w.x0, buffer);
        add_channels(parts[i].uints, Imf::UINT, uints, w.x0, buffer);
        Imf::OutputPart part(file, int(i));
        part.setFrameBuffer(buffer);
        part.writePixels(w.height());
    }
}

}  // namespace velatura::image
