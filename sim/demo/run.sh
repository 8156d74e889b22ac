#!/usr/bin/env bash
# Renders the demonstration from the maps beside this script: run.sh NADIR OUTPUT_FOLDER
set -euo pipefail
nadir=$(realpath "$1")
out=$(realpath -m "$2")
cd "$(dirname "$0")"

echo "1/3 Kampala: a low, slow flight over a 7.5 cm orthophoto"
"$nadir" render --map maps/kampala.tif --name rgb --bands 1,2,3 \
  --plane-height "1180 msl" --camera runs/rgb.yaml --poses runs/kampala.csv -o "$out/kampala" --force --explain

echo; echo "2/3 Spain: Sentinel-2 and Sentinel-1 under one camera, footprints of 2.5 km"
"$nadir" render --map maps/spain_s2.tif --name optical --bands B4,B3,B2 --output uint8 --range 0,2500 \
  --map maps/spain_s1.tif --name radar --bands VV \
  --plane-height "15 msl" --camera runs/rgb.yaml --poses runs/spain.csv -o "$out/spain" --force

echo; echo "3/3 North Dakota: one flight over aerial photographs of 2010 and of 2014"
"$nadir" render --map maps/naip_2010.tif --name y2010 --bands 1,2,3 --map maps/naip_2014.tif --name y2014 --bands 1,2,3 \
  --plane-height "560 msl" --camera runs/rgb.yaml --poses runs/naip.csv -o "$out/naip" --force

echo
echo "Look at:"
ls "$out"/*/*.png
