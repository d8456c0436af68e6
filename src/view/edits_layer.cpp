// SPDX-License-Identifier: Apache-2.0
#include "view/edits_layer.h"

#include "base/atomic_file.h"

#include <fmt/format.h>

#include <map>

namespace velatura::view {

namespace {

struct Prim {
    std::map<std::string, Prim> children;
    const PrimEdit* edit = nullptr;
};

Prim& prim_at(Prim& root, const std::string& path) {
    Prim* prim = &root;
    for (size_t at = 1; at < path.size();) {
        const size_t end = std::min(path.find('/', at), path.size());
        prim = &prim->children[path.substr(at, end - at)];
        at = end + 1;
    }
    return *prim;
}

void print(std::string& text, const std::string& name, const Prim& prim, const std::string& in) {
    const bool is_new = prim.edit && !prim.edit->type.empty();
    text += fmt::format("{0}{1} \"{2}\"\n{0}{{\n", in,
                        is_new ? "def " + prim.edit->type : std::string("over"), name);
    if (prim.edit)
        for (const std::string& line : prim.edit->lines)
            text += fmt::format("{}    {}\n", in, line);
    for (const auto& [child, below] : prim.children) print(text, child, below, in + "    ");
    text += in + "}\n";
}

}  // namespace

std::string edits_layer(const std::vector<PrimEdit>& edits) {
    Prim root;
    for (const PrimEdit& edit : edits) prim_at(root, edit.path).edit = &edit;
    std::string text = "#usda 1.0\n";
    for (const auto& [name, prim] : root.children) print(text, name, prim, "");
    return text;
}

Result<void> save_edits(const std::string& path, const std::vector<PrimEdit>& edits) {
    if (!path.ends_with(".usda")) return Error{"bad-output", path + ": edits are saved as .usda"};
    return write_file_atomically(path, edits_layer(edits));
}

}  // namespace velatura::view
