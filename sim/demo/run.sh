#!/usr/bin/env bash
# Flies the demonstration over the maps beside this script: run.sh NADIR OUTPUT_FOLDER
set -euo pipefail
nadir=$(realpath "$1")
out=$(realpath -m "$2")
cd "$(dirname "$0")/runs"

echo "1/6 Spain: an Aerosonde with an optical and a radar camera, footprints of 2.5 km"
"$nadir" fly spain.yaml -o "$out/spain" --force

echo; echo "2/6 North Dakota: cameras see the photograph of 2014, the onboard reference is of 2010"
"$nadir" fly naip.yaml -o "$out/naip" --force

echo; echo "3/6 North Dakota: a survey of a polygon, and an orbit"
"$nadir" fly survey.yaml -o "$out/survey" --force

echo; echo "4/6 Kampala: recorded poses, low and slow, over a 7.5 cm orthophoto"
"$nadir" fly kampala.yaml -o "$out/kampala" --force

echo; echo "5/6 Kampala: a quadrotor takes off, hovers and surveys at 60 m"
"$nadir" fly copter.yaml -o "$out/copter" --force

echo; echo "6/6 North Dakota: take-off, a circuit and a landing"
"$nadir" fly circuit.yaml -o "$out/circuit" --force

echo
echo "Open in a browser:"
ls "$out"/*/report.html
