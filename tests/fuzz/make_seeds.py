#!/usr/bin/python3
"""Writes what fuzzing starts from: small TIFFs of every packing into OUT/file, their first tiles into OUT/<codec>.

usage: make_seeds.py AWKWARD_FOLDER OUT
"""
import os
import shutil
import sys

from osgeo import gdal

gdal.UseExceptions()
SIDE = 32
CODECS = {
    "None": ("NONE", [[]]),
    "Lzw": ("LZW", [[], ["PREDICTOR=2"]]),
    "Deflate": ("DEFLATE", [[], ["PREDICTOR=2"]]),
    "Zstd": ("ZSTD", [[], ["PREDICTOR=2"]]),
    "Lzma": ("LZMA", [[]]),
    "Jpeg": ("JPEG", [["PHOTOMETRIC=YCBCR", "JPEGTABLESMODE=0"], ["JPEGTABLESMODE=0"]]),
    "WebP": ("WEBP", [[], ["WEBP_LOSSLESS=TRUE"]]),
    "Lerc": ("LERC", [[]]),
}


def samples(bands, size):
    return bytes((x * 7 + y * 13 + b * 50 + (x * y) % 5) & 255
                 for y in range(SIDE) for x in range(SIDE) for b in range(bands) for _ in range(size))


def write(path, codec, options, bands, gdal_type):
    driver = gdal.GetDriverByName("GTiff")
    all_options = ["TILED=YES", f"BLOCKXSIZE={SIDE}", f"BLOCKYSIZE={SIDE}", f"COMPRESS={codec}", *options]
    dataset = driver.Create(path, SIDE, SIDE, bands, gdal_type, all_options)
    data = samples(bands, gdal.GetDataTypeSize(gdal_type) // 8)
    size = gdal.GetDataTypeSize(gdal_type) // 8
    dataset.WriteRaster(0, 0, SIDE, SIDE, data, buf_type=gdal_type, buf_pixel_space=size * bands,
                        buf_line_space=size * bands * SIDE, buf_band_space=size)
    dataset.SetGeoTransform((500000, 1, 0, 5000000, 0, -1))
    dataset = None
    dataset = gdal.Open(path)
    offset, count = (int(dataset.GetRasterBand(1).GetMetadataItem(f"BLOCK_{what}_0_0", "TIFF"))
                     for what in ("OFFSET", "SIZE"))
    with open(path, "rb") as file:
        return file.read()[offset:offset + count]


def main():
    awkward, out = sys.argv[1:]
    os.makedirs(f"{out}/file", exist_ok=True)
    for name in os.listdir(awkward):
        if name.endswith(".tif") and os.path.getsize(f"{awkward}/{name}") < 1 << 16:
            shutil.copy(f"{awkward}/{name}", f"{out}/file/{name}")
    for codec, (gdal_name, variants) in CODECS.items():
        os.makedirs(f"{out}/{codec}", exist_ok=True)
        for i, options in enumerate(variants):
            picture = codec in ("Jpeg", "WebP")
            bands = [3] if picture else [1, 3]
            for count in bands:
                for width, gdal_type in enumerate([gdal.GDT_Byte] if picture else [gdal.GDT_Byte, gdal.GDT_UInt16]):
                    tile = write(f"{out}/file/{codec}_{i}_{count}_{width}.tif", gdal_name, options, count, gdal_type)
                    choice = count - 1 if codec != "WebP" else 0
                    choice |= width << 2 | (32 if "PREDICTOR=2" in options else 0)
                    with open(f"{out}/{codec}/{i}_{count}_{width}", "wb") as file:
                        file.write(bytes([choice]) + tile)


if __name__ == "__main__":
    main()
