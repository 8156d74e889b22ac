#include <gtest/gtest.h>

#include "nadir/render/camera.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr const char* ros_file =
    "image_width: 640\nimage_height: 480\ncamera_name: narrow\n"
    "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [500.25, 0, 319.5, 0, 501.75, 239.5, 0, 0, 1]\n"
    "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"
    "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
    "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [500.25, 0, 319.5, 0, 0, 501.75, 239.5, 0, 0, 0, 1, 0]\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(CameraFile, ThePrincipalPointGainsHalfAPixelComingInAndLosesItGoingOut) {
  const test::TemporaryFolder folder;
  const Camera camera = Camera::from_yaml(folder.write("c.yaml", ros_file)).value();
  EXPECT_EQ(camera.principal_point_px(), Eigen::Vector2d(320, 240)) << "the middle of 640 x 480";
  EXPECT_EQ(camera.ros_camera_matrix()(0, 2), 319.5);
  EXPECT_EQ(camera.name(), "narrow");
  const Eigen::Vector3d axis = camera.ray_from_image() * Eigen::Vector3d(320, 240, 1);
  EXPECT_NEAR((axis - Eigen::Vector3d(0, 0, 1)).norm(), 0, 1e-15);
}

TEST(CameraFile, ComesBackWithEveryDigit) {
  const test::TemporaryFolder folder;
  Camera camera = Camera::pinhole(1280, 720, 1000.0 / 3, 999.1234567890123, 640.1, 359.7).value();
  camera.set_name("left: \"odd\" name");
  const Camera again = Camera::from_yaml(folder.write("c.yaml", camera.to_yaml())).value();
  EXPECT_EQ(again.fx_px(), camera.fx_px());
  EXPECT_EQ(again.fy_px(), camera.fy_px());
  EXPECT_EQ(again.ros_camera_matrix(), camera.ros_camera_matrix());
  EXPECT_EQ(again.name(), camera.name());
}

TEST(CameraFile, LensesComeBackAsTheyWere) {
  const test::TemporaryFolder folder;
  const auto camera = Camera::from_yaml(
      folder.write("c.yaml", replaced(ros_file, "data: [0, 0, 0, 0, 0]", "data: [-0.3, 0.1, 0.001, -0.002, 0.05]")));
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->lens().coefficients(), (std::vector<double>{-0.3, 0.1, 0.001, -0.002, 0.05}));
  const auto again = Camera::from_yaml(folder.write("again.yaml", camera->to_yaml()));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->lens().coefficients(), camera->lens().coefficients());
  EXPECT_EQ(again->lens().model(), LensModel::plumb_bob);
}

TEST(CameraFile, FaultsNameTheirLine) {
  const test::TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    const auto camera = Camera::from_yaml(folder.write("c.yaml", text));
    return camera ? std::string("accepted") : camera.error().message;
  };
  const std::string unknown = message(replaced(ros_file, "camera_name", "camera_nmae"));
  EXPECT_NE(unknown.find("c.yaml:3: unknown key 'camera_nmae'; did you mean 'camera_name'?"), std::string::npos)
      << unknown;
  EXPECT_NE(
      message(replaced(ros_file, "  data: [500.25, 0,", "  data: [500.25,")).find("expected 9 finite numbers, found 8"),
      std::string::npos);
  EXPECT_NE(message(replaced(ros_file, "plumb_bob", "plumb_bop"))
                .find("c.yaml:8: 'distortion_model': no distortion model 'plumb_bop'; did you mean 'plumb_bob'?"),
            std::string::npos)
      << message(replaced(ros_file, "plumb_bob", "plumb_bop"));
  EXPECT_NE(message(replaced(ros_file, "plumb_bob", "equidistant")).find("at most 4 coefficients, found 5"),
            std::string::npos);
  EXPECT_NE(message(replaced(ros_file, "500.25, 0, 319.5", "-1, 0, 319.5")).find("focal lengths"), std::string::npos);
  EXPECT_NE(message(replaced(ros_file, "500.25, 0, 319.5", ".nan, 0, 319.5")).find("finite"), std::string::npos);
  EXPECT_NE(message(replaced(ros_file, "image_width: 640", "image_width: wide")).find("c.yaml:1: 'image_width'"),
            std::string::npos);
  EXPECT_NE(message(replaced(ros_file, "image_width: 640\n", "")).find("expected the key 'image_width'"),
            std::string::npos);
  const std::string two =
      message(replaced(replaced(ros_file, "camera_name", "camera_nmae"), "image_width: 640", "image_width: wide"));
  EXPECT_NE(two.find("c.yaml:1:"), std::string::npos) << "all faults at once";
  EXPECT_NE(two.find("c.yaml:3:"), std::string::npos);
  EXPECT_NE(message("image_width: [unclosed").find("c.yaml:1"), std::string::npos);
  EXPECT_NE(message("just text").find("expected"), std::string::npos);
  EXPECT_NE(message("").find("expected"), std::string::npos);
}

}  // namespace
}  // namespace nadir::render
