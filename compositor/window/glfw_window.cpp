// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/glfw_window.h"

#include "image/formats.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl2.h>

#include <algorithm>
#include <array>
#include <utility>

namespace velatura::compositor::window {

namespace {

std::string glfw_error() {
    const char* why = nullptr;
    glfwGetError(&why);
    return why ? why : "unknown reason";
}

Error no_display(const std::string& what) {
    return {"no-display", what + ": " + glfw_error()};
}

}  // namespace

Result<std::unique_ptr<GlfwWindow>> GlfwWindow::open(int width, int height) {
    if (!glfwInit()) return no_display("no window can be opened");
    // What the drawing asks for is in OpenGL 2.1, also over a network and without a graphics card
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 2);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
    glfwWindowHint(GLFW_SRGB_CAPABLE, GLFW_FALSE);
    GLFWwindow* window = glfwCreateWindow(width, height, "Velatura", nullptr, nullptr);
    if (!window) {
        const Error error = no_display("no window with OpenGL 2.1 can be opened");
        glfwTerminate();
        return error;
    }
    return std::unique_ptr<GlfwWindow>(new GlfwWindow(window));
}

GlfwWindow::GlfwWindow(GLFWwindow* window) : window_(window) {
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(window_, this);
    glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
        auto* self = static_cast<GlfwWindow*>(glfwGetWindowUserPointer(w));
        self->dropped_.insert(self->dropped_.end(), paths, paths + count);
    });
    float scale = 1, scale_y = 1;
    glfwGetWindowContentScale(window_, &scale, &scale_y);
    ImGui::CreateContext();
    // Where panels are is not the artist's to lose
    ImGui::GetIO().IniFilename = nullptr;
    fonts_ = set_up_theme(std::clamp(scale, 1.0f, 4.0f));
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL2_Init();
}

GlfwWindow::~GlfwWindow() {
    ImGui_ImplOpenGL2_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    glfwDestroyWindow(window_);
    glfwTerminate();
}

bool GlfwWindow::is_closing() const {
    return glfwWindowShouldClose(window_) != 0;
}

void GlfwWindow::wait(double max_s) {
    if (max_s > 0) {
        glfwWaitEventsTimeout(max_s);
    } else {
        glfwPollEvents();
    }
}

void GlfwWindow::wake() {
    glfwPostEmptyEvent();
}

std::vector<std::string> GlfwWindow::take_dropped() {
    return std::exchange(dropped_, {});
}

int GlfwWindow::key_index(int key) {
    constexpr std::array<std::pair<int, int>, 11> special = {{{key_up, GLFW_KEY_UP},
                                                              {key_down, GLFW_KEY_DOWN},
                                                              {key_left, GLFW_KEY_LEFT},
                                                              {key_right, GLFW_KEY_RIGHT},
                                                              {key_f1, GLFW_KEY_F1},
                                                              {key_f5, GLFW_KEY_F5},
                                                              {key_page_up, GLFW_KEY_PAGE_UP},
                                                              {key_page_down, GLFW_KEY_PAGE_DOWN},
                                                              {key_enter, GLFW_KEY_ENTER},
                                                              {key_escape, GLFW_KEY_ESCAPE},
                                                              {key_tab, GLFW_KEY_TAB}}};
    const auto at =
        std::find_if(special.begin(), special.end(), [&](const auto& s) { return s.first == key; });
    // GLFW calls letters, digits and signs by their ASCII codes
    return at == special.end() ? key : at->second;
}

std::vector<GlfwWindow::PressedKey> GlfwWindow::pressed_keys() {
    const ImGuiIO& io = ImGui::GetIO();
    std::vector<PressedKey> pressed;
    if (io.KeyAlt || io.KeySuper) return pressed;
    for (const int key : bound_keys()) {
        if (!ImGui::IsKeyPressed(key_index(key), true)) continue;
        const bool is_new = ImGui::IsKeyPressed(key_index(key), false);
        pressed.push_back({{key, io.KeyCtrl, io.KeyShift}, !is_new});
    }
    return pressed;
}

bool GlfwWindow::is_key_held() {
    const auto keys = bound_keys();
    return std::any_of(keys.begin(), keys.end(),
                       [](int key) { return ImGui::IsKeyDown(key_index(key)); });
}

void GlfwWindow::begin_frame(const std::function<void()>& change_input) {
    ImGui_ImplOpenGL2_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    change_input();
    ImGui::NewFrame();
}

Result<void> GlfwWindow::end_frame(const std::string& screenshot,
                                   const std::optional<Marks::Box>& box) {
    ImGui::Render();
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    glViewport(0, 0, width, height);
    glClearColor(color::workspace.x, color::workspace.y, color::workspace.z, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL2_RenderDrawData(ImGui::GetDrawData());
    const Result<void> written =
        screenshot.empty() ? Result<void>() : write_screen(screenshot, box);
    glfwSwapBuffers(window_);
    return written;
}

Result<void> GlfwWindow::write_screen(const std::string& path,
                                      const std::optional<Marks::Box>& box) const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    const int x0 = box ? int(box->x0) : 0, y0 = box ? int(box->y0) : 0;
    const int x1 = box ? int(box->x1) : width, y1 = box ? int(box->y1) : height;
    if (x0 < 0 || y0 < 0 || x1 > width || y1 > height || x0 >= x1 || y0 >= y1)
        return Error{"bad-script", "the area to capture is not on the screen"};
    std::vector<uint8_t> bytes(3 * size_t(x1 - x0) * size_t(y1 - y0));
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadBuffer(GL_BACK);
    // Rows of OpenGL count from the bottom
    glReadPixels(x0, height - y1, x1 - x0, y1 - y0, GL_RGB, GL_UNSIGNED_BYTE, bytes.data());
    std::vector<float> rgb(bytes.size());
    const size_t row = 3 * size_t(x1 - x0), rows = size_t(y1 - y0);
    for (size_t y = 0; y < rows; ++y) {
        std::transform(bytes.begin() + long((rows - 1 - y) * row),
                       bytes.begin() + long((rows - y) * row), rgb.begin() + long(y * row),
                       [](uint8_t b) { return float(b) / 255; });
    }
    return image::write_display_image(path, x1 - x0, y1 - y0, rgb);
}

}  // namespace velatura::compositor::window
