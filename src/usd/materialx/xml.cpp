// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/xml.h"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <type_traits>

namespace velatura::usd::materialx {

namespace {

struct ParserDeleter {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
};

using ParserPtr = std::unique_ptr<std::remove_pointer_t<XML_Parser>, ParserDeleter>;

/// What the callbacks of expat fill.
struct Building {
    XML_Parser parser = nullptr;
    uint32_t file_id = 0;
    XmlLimits limits;
    size_t first_line = 0;    ///< of the text that the parser sees, from 0
    size_t first_column = 0;  ///< of its first line
    XmlElement document;      ///< holds the root element
    std::vector<XmlElement*> open;
    size_t elements = 0;
    std::string rejection;  ///< empty: none

    SourceLoc here() const {
        const size_t line = XML_GetCurrentLineNumber(parser);
        const size_t column = XML_GetCurrentColumnNumber(parser) + (line == 1 ? first_column : 0);
        return {file_id, uint32_t(line + first_line), uint32_t(column) + 1};
    }

    void reject(std::string why) {
        if (rejection.empty()) rejection = std::move(why);
        XML_StopParser(parser, XML_FALSE);
    }
};

void start_element(void* data, const char* name, const char** attributes) {
    Building& b = *static_cast<Building*>(data);
    if (++b.elements > b.limits.elements)
        return b.reject(fmt::format("more than {} elements", b.limits.elements));
    if (b.open.size() > b.limits.depth)
        return b.reject(fmt::format("elements are nested deeper than {}", b.limits.depth));
    // Only the innermost open element grows, so that pointers to the others stay
    XmlElement& element = b.open.back()->children.emplace_back();
    element.name = name;
    element.loc = b.here();
    for (; attributes[0] != nullptr; attributes += 2)
        element.attributes.emplace_back(attributes[0], attributes[1]);
    b.open.push_back(&element);
}

void end_element(void* data, const char*) {
    static_cast<Building*>(data)->open.pop_back();
}

void start_doctype(void* data, const char*, const char*, const char*, int) {
    static_cast<Building*>(data)->reject("a document type declaration is refused");
}

}  // namespace

std::string_view XmlElement::attribute(std::string_view attribute_name) const {
    for (const auto& [key, value] : attributes) {
        if (key == attribute_name) return value;
    }
    return {};
}

Result<XmlElement> read_xml(std::string_view bytes,
                            const std::string& file,
                            Diagnostics& diagnostics,
                            const XmlLimits& limits) {
    Building building;
    building.file_id = diagnostics.file_id(file);
    building.limits = limits;
    const auto fail = [&](SourceLoc where, const std::string& what) {
        diagnostics.error("mtlx-xml", where, "", what);
        return Error{"mtlx-xml", fmt::format("\"{}\" is not readable XML", file)};
    };
    if (bytes.size() > limits.bytes) {
        return fail({building.file_id, 1, 1},
                    fmt::format("the file has {} bytes, limit is {}", bytes.size(), limits.bytes));
    }
    // Space before the declaration is no XML, and other readers take it
    const size_t start = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
    const std::string_view space = bytes.substr(0, start);
    building.first_line = size_t(std::count(space.begin(), space.end(), '\n'));
    building.first_column = space.size() - (space.rfind('\n') + 1);
    bytes.remove_prefix(start);
    const ParserPtr parser(XML_ParserCreate(nullptr));
    if (!parser) return fail({building.file_id, 1, 1}, "out of memory while reading XML");
    building.parser = parser.get();
    building.open = {&building.document};
    XML_SetUserData(parser.get(), &building);
    XML_SetElementHandler(parser.get(), start_element, end_element);
    XML_SetStartDoctypeDeclHandler(parser.get(), start_doctype);
    if (XML_Parse(parser.get(), bytes.data(), int(bytes.size()), XML_TRUE) != XML_STATUS_OK) {
        const char* why = XML_ErrorString(XML_GetErrorCode(parser.get()));
        return fail(building.here(),
                    building.rejection.empty() ? std::string(why) : building.rejection);
    }
    return std::move(building.document.children.front());
}

}  // namespace velatura::usd::materialx
