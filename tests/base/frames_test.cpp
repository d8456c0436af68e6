// SPDX-License-Identifier: Apache-2.0
#include "base/frames.h"

#include "base/atomic_file.h"
#include "folder_test.h"

#include <gtest/gtest.h>

namespace velatura {
namespace {

class Frames : public FolderTest {
  protected:
    std::string path(const std::string& name) const { return (folder_ / name).string(); }

    void make(const std::string& name) const {
        ASSERT_TRUE(write_file_atomically(path(name), "x"));
    }
};

/// The names of 30 files, whose file at a frame is what printf writes for %0Nd: a sign is one of
/// the digits, and numbers that need more digits have them.
TEST_F(Frames, NamesOfFilesByFrame) {
    struct Row {
        const char *name, *at_7, *at_minus_3, *at_12345;
    };

    for (const Row& row : std::vector<Row>{
             // One file, whatever the frame is
             {"shot.exr", "shot.exr", "shot.exr", "shot.exr"},
             {"take#2.exr", "take#2.exr", "take#2.exr", "take#2.exr"},
             {"50%done.exr", "50%done.exr", "50%done.exr", "50%done.exr"},
             {"50%.exr", "50%.exr", "50%.exr", "50%.exr"},
             {"%s.exr", "%s.exr", "%s.exr", "%s.exr"},
             {"my%20dir.exr", "my%20dir.exr", "my%20dir.exr", "my%20dir.exr"},
             {"$Foo.exr", "$Foo.exr", "$Foo.exr", "$Foo.exr"},
             {"$F_x.exr", "$F_x.exr", "$F_x.exr", "$F_x.exr"},
             {"a<F.exr", "a<F.exr", "a<F.exr", "a<F.exr"},
             {"a<F4x>.exr", "a<F4x>.exr", "a<F4x>.exr", "a<F4x>.exr"},
             {"%99d.exr", "%99d.exr", "%99d.exr", "%99d.exr"},
             {"a#b/shot.exr", "a#b/shot.exr", "a#b/shot.exr", "a#b/shot.exr"},
             // A file per frame
             {"shot.####.exr", "shot.0007.exr", "shot.-003.exr", "shot.12345.exr"},
             {"shot.##.exr", "shot.07.exr", "shot.-3.exr", "shot.12345.exr"},
             {"shot.#.exr", "shot.7.exr", "shot.-3.exr", "shot.12345.exr"},
             {"shot#.exr", "shot7.exr", "shot-3.exr", "shot12345.exr"},
             {"####.exr", "0007.exr", "-003.exr", "12345.exr"},
             {"shot####", "shot0007", "shot-003", "shot12345"},
             {"shot.%04d.exr", "shot.0007.exr", "shot.-003.exr", "shot.12345.exr"},
             {"shot.%4d.exr", "shot.0007.exr", "shot.-003.exr", "shot.12345.exr"},
             {"shot.%d.exr", "shot.7.exr", "shot.-3.exr", "shot.12345.exr"},
             {"shot.$F4.exr", "shot.0007.exr", "shot.-003.exr", "shot.12345.exr"},
             {"shot.$F.exr", "shot.7.exr", "shot.-3.exr", "shot.12345.exr"},
             {"shot.<F4>.exr", "shot.0007.exr", "shot.-003.exr", "shot.12345.exr"},
             {"shot.<F>.exr", "shot.7.exr", "shot.-3.exr", "shot.12345.exr"},
             // Of several the last, in folders too, and all that are the same
             {"take#2.####.exr", "take#2.0007.exr", "take#2.-003.exr", "take#2.12345.exr"},
             {"a#_####.exr", "a#_0007.exr", "a#_-003.exr", "a#_12345.exr"},
             {"s.####/b.####.exr", "s.0007/b.0007.exr", "s.-003/b.-003.exr", "s.12345/b.12345.exr"},
             {"s.$F4/b.exr", "s.0007/b.exr", "s.-003/b.exr", "s.12345/b.exr"},
             {"a#b/shot.##.exr", "a#b/shot.07.exr", "a#b/shot.-3.exr", "a#b/shot.12345.exr"}}) {
        EXPECT_EQ(frame_path(row.name, 7), row.at_7);
        EXPECT_EQ(frame_path(row.name, -3), row.at_minus_3);
        EXPECT_EQ(frame_path(row.name, 12345), row.at_12345);
        EXPECT_EQ(is_sequence(row.name), std::string(row.name) != row.at_7) << row.name;
        // What was named is found
        const bool is_one = !is_sequence(path(row.name));
        for (const int frame : {7, -3, 12345}) make(frame_path(row.name, frame));
        EXPECT_EQ(frames_on_disk(path(row.name)),
                  is_one ? std::vector<int>() : (std::vector<int>{-3, 7, 12345}))
            << row.name;
        EXPECT_EQ(files_of(path(row.name)).size(), is_one ? 1u : 3u) << row.name;
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    EXPECT_EQ(frame_path("shot.####.exr", 1.5), "shot.0001.500.exr");
    EXPECT_EQ(frame_path("shot.%04d.exr", -0.25), "shot.-000.250.exr");
}

/// What is called like a pattern is a file when it is there, and no frame of the pattern is.
TEST_F(Frames, FilesThatOnlyLookLikePatterns) {
    for (const char* name : {"C#.exr", "a.%d.exr", "a.$F.exr", "b.####.exr"}) {
        EXPECT_TRUE(is_sequence(path(name))) << name;
        make(name);
        EXPECT_FALSE(is_sequence(path(name))) << name;
        EXPECT_EQ(frame_path(path(name), 7), path(name));
        EXPECT_EQ(files_of(path(name)), std::vector<std::string>{path(name)});
    }
    // A file called ####, left by a program that knows no patterns, hides no frames
    make("b.0001.exr");
    EXPECT_TRUE(is_sequence(path("b.####.exr")));
    make("d##/x");
    EXPECT_FALSE(is_sequence(path("d##/b.exr")));
    EXPECT_EQ(frame_path(path("d##/b.##.exr"), 1), path("d##/b.01.exr"));
}

TEST_F(Frames, OnDiskWithGapsSignsAndOtherNames) {
    for (const char* name : {"s.03.exr", "s.1.exr", "s.12.exr", "s.100.exr", "s.xx.exr", "s.07.png",
                             "s.-4.exr", "s.-05.exr", "s.007.exr", "s.99999999999.exr", "s..exr"})
        make(name);
    EXPECT_EQ(frames_on_disk(path("s.##.exr")), (std::vector<int>{-5, -4, 3, 12, 100}));
    EXPECT_EQ(frame_file(path("s.##.exr"), -4), path("s.-4.exr"));
    EXPECT_EQ(frame_file(path("s.##.exr"), -5), path("s.-05.exr"));
    EXPECT_EQ(frame_file(path("s.##.exr"), -6), path("s.-6.exr"));
    EXPECT_EQ(frames_on_disk(path("s.#.exr")), (std::vector<int>{-4, 1, 12, 100}));
    EXPECT_TRUE(frames_on_disk("/nonexistent_folder/a.##.exr").empty());
    // Digits may follow
    for (const char* name : {"v15.exr", "v25.exr", "v6.exr"}) make(name);
    EXPECT_EQ(frames_on_disk(path("v<F>5.exr")), (std::vector<int>{1, 2}));
}

TEST(FrameLists, AreReadInTheirOrderOrAscending) {
    EXPECT_EQ(*parse_frames("1-10x3,15"), (std::vector<double>{1, 4, 7, 10, 15}));
    EXPECT_EQ(*parse_frames("5-3"), (std::vector<double>{5, 4, 3}));
    EXPECT_EQ(*parse_frames("-2--1"), (std::vector<double>{-2, -1}));
    EXPECT_EQ(*parse_frames("1-3x2,1"), (std::vector<double>{1, 3}));
    EXPECT_EQ(*parse_frames("1.5"), (std::vector<double>{1.5}));
    EXPECT_EQ(parse_frames("0-1x0.1")->size(), 11u);
    EXPECT_EQ(*parse_whole_frames("10,1-3,2"), (std::vector<int>{1, 2, 3, 10}));
    EXPECT_EQ(*parse_whole_frames("-5-5x5,9-8"), (std::vector<int>{-5, 0, 5, 8, 9}));
    for (const char* bad :
         {"", "a", "1-", "1-2x0", "1-2x-1", "1,,2", "1-1e12", "nan", "inf", "1-99999999999"}) {
        EXPECT_EQ(parse_frames(bad).error().code, "bad-frames") << bad;
        EXPECT_EQ(parse_whole_frames(bad).error().code, "bad-frames") << bad;
    }
    EXPECT_FALSE(parse_whole_frames("1.5"));
    EXPECT_EQ(frame_list({1, 2, 3, 7, 9, 10}), "1-3,7,9-10");
    EXPECT_EQ(frame_list({-3, -2, 0}), "-3--2,0");
    EXPECT_EQ(*parse_whole_frames(frame_list({-3, -2, 0})), (std::vector<int>{-3, -2, 0}));
    EXPECT_EQ(frame_list({}), "");
}

TEST(FrameNames, TellAFrameAndHaveOneForm) {
    EXPECT_EQ(frame_in_name("v2/shot_v3.0007.exr"), 7);
    EXPECT_EQ(frame_in_name("shot.-007.exr"), -7);
    EXPECT_EQ(frame_in_name("shot-7.exr"), 7);
    EXPECT_EQ(frame_in_name("v2/shot.exr"), std::nullopt);
    EXPECT_EQ(frame_in_name("9999999999.exr"), std::nullopt);
    for (const char* name : {"a.%04d.exr", "a.$F4.exr", "a.<F4>.exr", "a.####.exr"})
        EXPECT_EQ(with_hashes(name), "a.####.exr");
    EXPECT_EQ(with_hashes("a.%d.exr"), "a.#.exr");
    EXPECT_EQ(with_hashes("take#2.exr"), "take#2.exr");
    EXPECT_FALSE(is_plainly_sequence("C#.exr"));
    EXPECT_TRUE(is_plainly_sequence("C.##.exr"));
}

}  // namespace
}  // namespace velatura
