// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/item_reader.h"

#include "usd/crate/stored.h"
#include "usd/crate/value_reader.h"

#include <fmt/format.h>

namespace velatura::usd::crate {

using layer::Value;

void ItemReader::item(Cursor& c, std::string& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    uint64_t copied = 0;
    if (!c.ok()) return;
    if (!load_text(*context_.file, index, out, copied)) {
        c.fail_at(at, fmt::format("string {}", index),
                  fmt::format("one of {}", context_.file->strings.size()));
    }
    context_.spend(c, copied);
}

void ItemReader::item(Cursor& c, layer::Token& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    uint64_t copied = 0;
    if (c.ok() && !load_text(*context_.file, index, out, copied)) {
        c.fail_at(at, fmt::format("token {}", index),
                  fmt::format("one of {}", context_.file->tokens.size()));
    }
}

void ItemReader::item(Cursor& c, layer::Path& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    if (!c.ok()) return;
    if (index >= context_.file->paths.size()) {
        c.fail_at(at, fmt::format("path {}", index),
                  fmt::format("one of {}", context_.file->paths.size()));
        return;
    }
    out = context_.file->paths[index];
}

void ItemReader::item(Cursor& c, layer::LayerOffset& out) {
    out.offset = c.read<double>();
    out.scale = c.read<double>();
}

void ItemReader::item(Cursor& c, layer::Reference& out) {
    item(c, out.asset);
    item(c, out.prim_path);
    item(c, out.offset);
    item(c, out.custom_data);
}

void ItemReader::item(Cursor& c, layer::Payload& out) {
    item(c, out.asset);
    item(c, out.prim_path);
    if (context_.file->version >= Version{0, 8, 0}) item(c, out.offset);
}

void ItemReader::item(Cursor& c, layer::UnregisteredValue& out) {
    Value value;
    item(c, value);
    if (const auto* text = value.get_if<std::string>()) {
        out.text = *text;
    } else if (c.ok()) {
        c.fail("an item of another type in a list of unregistered values", "text");
    }
}

void ItemReader::item(Cursor& c, Value& out) {
    // What is stored with the value lies between the offset and the ValueRep, after which the
    // surrounding value goes on
    const uint64_t at = c.at();
    if (!c.follow()) return;
    const ValueRep rep{c.read<uint64_t>()};
    if (!c.ok()) return;
    if (!context_.spend(c, sizeof(Value))) return;
    if (values_.read(rep, out)) return;
    const Problem& problem = context_.problem;
    c.fail(problem.at != 0 ? problem : Problem{at, problem.message});
}

void ItemReader::item(Cursor& c, layer::Dictionary& out) {
    if (context_.depth >= max_value_depth) {
        c.fail(fmt::format("more than {} levels of values", max_value_depth), "fewer");
        return;
    }
    ++context_.depth;
    const uint64_t n = context_.count(c, 12, 64);
    for (uint64_t i = 0; i < n && c.ok(); ++i) {
        std::string key;
        item(c, key);
        Value value;
        item(c, value);
        if (c.ok()) out.entries[std::move(key)] = std::move(value);
    }
    --context_.depth;
}

}  // namespace velatura::usd::crate
