// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/snapshot_strip.h"

#include "compositor/window/widgets.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

namespace velatura::compositor::window {

namespace {

/// Of a small image, in lines of text.
constexpr float lines = 4;

}  // namespace

SnapshotStrip::~SnapshotStrip() {
    for (const auto& [number, texture] : textures_) glDeleteTextures(1, &texture);
}

float SnapshotStrip::height(const Session& session) {
    if (session.snapshots().empty()) return 0;
    return lines * ImGui::GetFontSize() + ImGui::GetFrameHeight() + 1.6f * ImGui::GetFontSize();
}

unsigned SnapshotStrip::texture_of(const Snapshot& snapshot) {
    unsigned& texture = textures_[snapshot.number];
    if (texture) return texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, snapshot.width, snapshot.height, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, snapshot.rgba.data());
    return texture;
}

void SnapshotStrip::draw(Drawing& drawing) {
    Session& session = drawing.session;
    const auto& all = session.snapshots();
    // What was removed, or dropped for a newer one
    std::erase_if(textures_, [&](const auto& known) {
        const bool is_there = std::any_of(
            all.begin(), all.end(), [&](const Snapshot& s) { return s.number == known.first; });
        if (!is_there) glDeleteTextures(1, &known.second);
        return !is_there;
    });
    std::optional<size_t> removed, shown, used;
    for (size_t i = 0; i < all.size(); ++i) {
        const Snapshot& s = all[i];
        if (i > 0) ImGui::SameLine();
        ImGui::PushID(int(s.number));
        ImGui::BeginGroup();
        const float height = lines * ImGui::GetFontSize(),
                    width = height * float(s.width) / float(s.height);
        const bool is_compared = session.compared() == s.title;
        const ImVec4 border = is_compared ? color::accent : color::line;
        ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(texture_of(s))),
                     {width, height}, {0, 0}, {1, 1}, {1, 1, 1, 1}, border);
        if (ImGui::IsItemClicked()) shown = i;
        note_item(drawing, s.title);
        explain("Show it as B, beside the image as it continues (W: wipe)");
        text(fmt::format("{} · {}", s.number, s.note), color::dim);
        ImGui::SameLine();
        if (quiet_button("look", "Look", true)) used = i;
        note_item(drawing, "look of " + s.title);
        explain("Use its look");
        ImGui::SameLine();
        if (quiet_button("remove", "×", true)) removed = i;
        note_item(drawing, "remove " + s.title);
        ImGui::EndGroup();
        ImGui::PopID();
    }
    if (shown) session.compare_with_snapshot(*shown);
    if (used) session.use_look_of_snapshot(*used);
    if (removed) session.remove_snapshot(*removed);
}

}  // namespace velatura::compositor::window
