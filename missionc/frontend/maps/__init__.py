"""Maps: conversion of other programs' files to shapes and points in metres, with a module for each format."""
