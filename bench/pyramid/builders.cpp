#include "builders.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "nadir/base/text.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

std::string codec_name(BuildCodec codec) {
  constexpr std::array names = {"none", "jpeg", "deflate", "zstd"};
  return names[static_cast<std::size_t>(codec)];
}

/// What a program tells on standard output. Nothing where it cannot be run.
std::optional<std::string> output_of(const std::string& program, const std::string& argument) {
  std::string quoted = "'";
  for (const char c : program) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  struct Close {
    void operator()(FILE* pipe) const { ::pclose(pipe); }
  };
  const std::unique_ptr<FILE, Close> pipe(::popen((quoted + "' " + argument + " 2>&1").c_str(), "r"));
  if (!pipe) return std::nullopt;
  std::string text;
  std::array<char, 4096> block{};
  while (const std::size_t n = std::fread(block.data(), 1, block.size(), pipe.get())) text.append(block.data(), n);
  return text;
}

/// A peer's method, left out where its program is not installed.
Method peer(const std::string& name, std::vector<std::string> command, const std::string& program,
            const std::string& package) {
  Method method{.name = name, .command = std::move(command)};
  if (!on_path(program)) method.left_out = fmt::format("{} is not installed (package {})", program, package);
  return method;
}

}  // namespace

std::string BuildPacking::name() const {
  switch (codec) {
    case BuildCodec::none:
      return "none";
    case BuildCodec::jpeg:
      return half_chroma ? "jpeg 4:2:0" : "jpeg 4:4:4";
    case BuildCodec::deflate:
    case BuildCodec::zstd:
      break;
  }
  return fmt::format("{} {}", codec_name(codec), level);
}

Result<NadirBuild> NadirBuild::find() {
  std::error_code problem;
  const fs::path program = fs::read_symlink("/proc/self/exe", problem).parent_path() / "nadir-build";
  if (::access(program.c_str(), X_OK) != 0)
    return fail(Error::Kind::NotFound, program.string() + ": expected the program of `nadir build` beside nadir-bench");
  auto help = output_of(program.string(), "--help");
  if (!help) return fail(Error::Kind::Io, program.string() + ": cannot be run");
  return NadirBuild(program.string(), std::move(*help));
}

std::vector<std::string> NadirBuild::command(const std::vector<std::string>& sources, const std::string& output,
                                             const std::vector<std::pair<std::string, std::string>>& options,
                                             std::string& left_out) const {
  std::vector<std::string> words = {program_};
  words.insert(words.end(), sources.begin(), sources.end());
  words.insert(words.end(), {"-o", output});
  for (const auto& [option, value] : options)
    if (knows(option))
      words.insert(words.end(), {option, value});
    else
      left_out += fmt::format("{}{}", left_out.empty() ? "without " : " ", option);
  return words;
}

Method nadir_method(const Result<NadirBuild>& nadir, const std::string& source, const std::string& output,
                    const BuildPacking& packing) {
  Method method{.name = "nadir"};
  if (!nadir) {
    method.left_out = nadir.error().message;
    return method;
  }
  std::vector<std::pair<std::string, std::string>> options = {{"--role", "optical"},
                                                              {"--filter", "box"},
                                                              {"--compress", codec_name(packing.codec)},
                                                              {"--tile-size", std::to_string(build_tile_side)},
                                                              {"--memory", fmt::format("{}MiB", build_memory_mib)},
                                                              {"--threads", std::to_string(build_threads)}};
  if (packing.codec == BuildCodec::jpeg) {
    options.emplace_back("--quality", "90");
    options.emplace_back("--chroma", packing.half_chroma ? "420" : "444");
  } else if (packing.codec != BuildCodec::none) {
    options.emplace_back("--level", std::to_string(packing.level));
    options.emplace_back("--predictor", "horizontal");
  }
  method.command = nadir->command({source}, output, options, method.setting);
  return method;
}

Method vips_method(const std::string& source, const std::string& output, const BuildPacking& packing) {
  const std::string side = std::to_string(build_tile_side);
  std::vector<std::string> words = {"env",
                                    fmt::format("VIPS_CONCURRENCY={}", build_threads),
                                    "vips",
                                    "tiffsave",
                                    source,
                                    output,
                                    "--tile",
                                    "--pyramid",
                                    "--bigtiff",
                                    "--tile-width",
                                    side,
                                    "--tile-height",
                                    side,
                                    "--compression",
                                    codec_name(packing.codec)};
  std::string setting;
  switch (packing.codec) {
    case BuildCodec::none:
      break;
    case BuildCodec::jpeg: {
      // Versions without the option halve the chroma below quality 90, and none stores all of it as YCbCr
      const bool chooses = output_of("vips", "tiffsave").value_or("").find("subsample-mode") != std::string::npos;
      if (chooses) words.insert(words.end(), {"--subsample-mode", packing.half_chroma ? "on" : "off"});
      const bool less = packing.half_chroma && !chooses;
      words.insert(words.end(), {"--Q", less ? "89" : "90"});
      setting = less ? "quality 89" : packing.half_chroma ? "" : "stored as RGB";
      break;
    }
    case BuildCodec::deflate:  // its level is zlib's usual one, 6
      words.insert(words.end(), {"--predictor", "horizontal"});
      break;
    case BuildCodec::zstd:
      words.insert(words.end(), {"--predictor", "horizontal", "--level", std::to_string(packing.level)});
      break;
  }
  Method method = peer("libvips", std::move(words), "vips", "libvips-tools");
  method.setting = setting;
  return method;
}

std::vector<std::string> gdal_cog_command(const std::string& source, const std::string& output,
                                          const BuildPacking& packing) {
  std::vector<std::string> words = {"gdal_translate", "-q", "--config", "GDAL_CACHEMAX",
                                    std::to_string(build_memory_mib)};
  const auto option = [&](const std::string& text) { words.insert(words.end(), {"-co", text}); };
  words.insert(words.end(), {"-of", "COG"});
  constexpr std::array codecs = {"NONE", "JPEG", "DEFLATE", "ZSTD"};
  option(fmt::format("COMPRESS={}", codecs[static_cast<std::size_t>(packing.codec)]));
  option(fmt::format("BLOCKSIZE={}", build_tile_side));
  option(fmt::format("NUM_THREADS={}", build_threads));
  option("OVERVIEW_RESAMPLING=AVERAGE");
  option("BIGTIFF=IF_SAFER");
  if (packing.codec == BuildCodec::jpeg) option("QUALITY=90");
  if (packing.codec == BuildCodec::deflate || packing.codec == BuildCodec::zstd) {
    option("PREDICTOR=YES");
    option(fmt::format("LEVEL={}", packing.level));
  }
  words.insert(words.end(), {source, output});
  return words;
}

Method gdal_method(const std::string& source, const std::string& output, const BuildPacking& packing) {
  Method method = peer("GDAL COG", gdal_cog_command(source, output, packing), "gdal_translate", "gdal-bin");
  if (packing.codec == BuildCodec::jpeg && !packing.half_chroma)
    method.left_out = "its COG driver always halves the chroma";
  return method;
}

Method maketx_method(const std::string& source, const std::string& output, const BuildPacking& packing) {
  const std::string side = std::to_string(build_tile_side);
  std::vector<std::string> words = {"maketx", "--threads", std::to_string(build_threads), "--tile", side, side};
  words.insert(words.end(), {"--filter", "box", "--wrap", "clamp", "--no-compute-average", "--format", "tiff"});
  words.insert(words.end(), {"--compression", packing.codec == BuildCodec::none ? "none" : "zip"});
  if (packing.codec == BuildCodec::deflate)
    words.insert(words.end(), {"--attrib", "tiff:zipquality", std::to_string(packing.level)});
  words.insert(words.end(), {source, "-o", output});
  return peer("maketx", std::move(words), "maketx", "openimageio-tools");
}

bool on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  for (const std::string_view folder : split(path ? path : "/usr/bin:/bin", ':'))
    if (::access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace nadir::bench
