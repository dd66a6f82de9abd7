"""What every server of pages needs: connections, the skeleton of pages with their guards, and who may ask."""
