#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// All builders work with as many threads, whatever the machine has: results of machines stay comparable.
constexpr int build_threads = 2;
constexpr int build_tile_side = 512;
/// What nadir may take and what GDAL may cache.
constexpr int build_memory_mib = 512;

enum class BuildCodec { none, jpeg, deflate, zstd };

/// How tiles of a case are packed, by every builder alike; byte streams behind the horizontal predictor.
struct BuildPacking {
  BuildCodec codec = BuildCodec::none;
  int level = 0;            // of deflate and zstd
  bool half_chroma = true;  // of JPEG, whose quality is 90
  bool lossless() const { return codec != BuildCodec::jpeg; }
  std::string name() const;  // "zstd 3", "jpeg 4:2:0"
};

/// The program `nadir build` that lies beside this one, and the options it knows.
class NadirBuild {
 public:
  /// Looks at `nadir-build --help`. NotFound where there is no such program.
  static Result<NadirBuild> find();

  bool knows(const std::string& option) const { return help_.find(option) != std::string::npos; }

  /// The command for `sources`, with those of `options` (each with its value) that it knows; `left_out`: the others.
  std::vector<std::string> command(const std::vector<std::string>& sources, const std::string& output,
                                   const std::vector<std::pair<std::string, std::string>>& options,
                                   std::string& left_out) const;

 private:
  NadirBuild(std::string program, std::string help) : program_(std::move(program)), help_(std::move(help)) {}
  std::string program_, help_;
};

/// Methods that make `output` from the raster `source`, with names, commands or the reason why they are left out.
Method nadir_method(const Result<NadirBuild>& nadir, const std::string& source, const std::string& output,
                    const BuildPacking& packing);
Method vips_method(const std::string& source, const std::string& output, const BuildPacking& packing);
Method gdal_method(const std::string& source, const std::string& output, const BuildPacking& packing);
Method maketx_method(const std::string& source, const std::string& output, const BuildPacking& packing);

/// Whether a program of that name is on the PATH.
bool on_path(const std::string& program);

/// The command of GDAL's COG driver.
std::vector<std::string> gdal_cog_command(const std::string& source, const std::string& output,
                                          const BuildPacking& packing);

}  // namespace nadir::bench
