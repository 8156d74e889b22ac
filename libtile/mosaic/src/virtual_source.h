#pragma once

#include <cpl_conv.h>
#include <fmt/format.h>

#include <string>

namespace nadir::mosaic {

inline std::string xml_escaped(const std::string& text) {
  char* escaped = CPLEscapeString(text.c_str(), -1, CPLES_XML);
  std::string copy = escaped;
  CPLFree(escaped);
  return copy;
}

/// One piece of a band of a GDAL virtual raster: a whole raster laid down at (x, y).
struct VirtualSource {
  std::string path;
  std::string band;  // "3", or "mask,1"
  std::string type;  // as GDAL names it
  int width = 0, height = 0;
  int x = 0, y = 0;
  std::string rule;  // further elements: what is see-through, how values change

  std::string xml() const {
    return fmt::format(
        "<ComplexSource><SourceFilename relativeToVRT=\"0\" "
        "shared=\"0\">{0}</SourceFilename><SourceBand>{1}</SourceBand>"
        "<SourceProperties RasterXSize=\"{3}\" RasterYSize=\"{4}\" DataType=\"{2}\" BlockXSize=\"256\" "
        "BlockYSize=\"256\"/>"
        "<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"{3}\" ySize=\"{4}\"/>"
        "<DstRect xOff=\"{5}\" yOff=\"{6}\" xSize=\"{3}\" ySize=\"{4}\"/>{7}</ComplexSource>\n",
        xml_escaped(path), band, type, width, height, x, y, rule);
  }
};

}  // namespace nadir::mosaic
