"""Form factors between patches, as sparse rows, by three estimators behind one interface."""
